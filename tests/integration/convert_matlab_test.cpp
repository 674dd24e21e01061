// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Slow: ConvertMatlab.FilesAre*:ConvertMatlab.Doubles*:ConvertMatlab.Stored*
// Rooms: foreign plugins
// MATLAB files of version 5, written by SciPy and byte by byte, converted to captures.
#include <gmock/gmock.h>
#include <hdf5.h>

#include "tests/small_conversion.hpp"

using namespace tofgraph::tests;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

namespace {

/// Functions that write the elements of a file.
constexpr const char* writer = R"(
import struct, zlib
def head(order="<"):
    return b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack(order + "H", 0x100) + (b"IM" if order == "<" else b"MI")
def element(order, kind, data):
    return struct.pack(order + "II", kind, len(data)) + data + bytes(-len(data) % 8)
def variable(order, name, type_of_class, array, stored, kind):
    parts = element(order, 6, struct.pack(order + "II", type_of_class, 0))
    parts += element(order, 5, np.array(array.shape, order + "i4").tobytes()) + element(order, 1, name)
    return element(order, 14, parts + element(order, kind, array.astype(order + stored).tobytes("F")))
def structure(name, width, names, fields):
    parts = element("<", 6, struct.pack("<II", 2, 0)) + element("<", 5, struct.pack("<ii", 1, 1))
    parts += element("<", 1, name) + element("<", 5, struct.pack("<i", width)) + element("<", 1, names)
    return element("<", 14, parts + fields)
def packed(variable):
    data = zlib.compress(variable)
    return struct.pack("<II", 15, len(data)) + data
def save(name, content, order="<"):
    with open(name, "wb") as file:
        file.write(head(order) + content)
)";

class ConvertMatlab : public SmallConversion {
 protected:
  bool write(const std::string& script) const { return python(writer + script); }
};

TEST_F(ConvertMatlab, FilesAreReadInMatlabsOrder) {
  if (!python(R"(
import scipy.io
rng = np.random.default_rng(5)
a = rng.integers(1, 4000, (6, 8, 5))
for kind in ["f8", "f4", "u2", "i2", "u1"]:
    x = (a % 250 + 1).astype(kind)
    scipy.io.savemat(f"{kind}.mat", {"amplitude": x, "note": "text", "cell": np.array([1, "a"], dtype=object)})
    scipy.io.savemat(f"{kind}_c.mat", {"amplitude": x}, do_compression=True)
np.moveaxis(a % 250 + 1, 2, 0).astype("<f4").tofile("expected.bin")
)"))
    GTEST_SKIP() << "SciPy is not installed";
  const std::vector<float> expected = stored<float>("expected.bin");
  for (const std::string kind : {"f8", "f4", "u2", "i2", "u1"}) {
    for (const std::string end : {"", "_c"}) {
      const Outcome outcome = convert(kind + end + ".mat");
      ASSERT_EQ(outcome.exit_code, 0) << kind << end << outcome.err;
      EXPECT_EQ(frames<float>("amplitude"), expected) << kind << end;
    }
  }
}

TEST_F(ConvertMatlab, ArraysOfFourAxesAreReadBitForBit) {
  if (!python(R"(
import scipy.io
x = np.random.default_rng(7).integers(-3000, 3000, (6, 8, 4, 5)).astype("i2")
scipy.io.savemat("plain.mat", {"x": x})
scipy.io.savemat("packed.mat", {"x": x}, do_compression=True)
np.transpose(x, (3, 2, 0, 1)).astype("<i2").tofile("expected.bin")
)"))
    GTEST_SKIP() << "SciPy is not installed";
  for (const std::string name : {"plain.mat", "packed.mat"}) {
    const Outcome outcome = convert(name + " --as phases=x --axes 'row column exposure frame'");
    ASSERT_EQ(outcome.exit_code, 0) << name << outcome.err;
    EXPECT_EQ(frames<std::int16_t>("phases"), stored<std::int16_t>("expected.bin")) << name;
  }
}

/// As MATLAB writes doubles that are small integers, and in the byte order of old workstations.
TEST_F(ConvertMatlab, DoublesInFewerBytesAndBigEndianFilesAreReadBitForBit) {
  ASSERT_TRUE(write(R"(
x = np.random.default_rng(8).integers(1, 250, (6, 8, 3))
for order in "<>":
    for name, cls, stored, kind in [("d1", 6, "u1", 2), ("d2", 6, "i2", 3), ("d8", 6, "f8", 9), ("w2", 11, "u2", 4)]:
        save(name + ("b" if order == ">" else "l") + ".mat", variable(order, b"x", cls, x, stored, kind), order)
np.moveaxis(x, 2, 0).astype("<f4").tofile("expected.bin")
)"));
  for (const std::string name : {"d1l", "d2l", "d8l", "w2l", "d1b", "d2b", "d8b", "w2b"}) {
    const Outcome outcome = convert(name + ".mat --as amplitude");
    ASSERT_EQ(outcome.exit_code, 0) << name << outcome.err;
    EXPECT_EQ(frames<float>("amplitude"), stored<float>("expected.bin")) << name;
  }
}

TEST_F(ConvertMatlab, StoredValuesThatDoNotFitTheirTypeAreRefused) {
  ASSERT_TRUE(write(R"(
x = np.ones((6, 8, 3))
cases = [("wide", 9, x * 1000, "i4", 5), ("fraction", 10, x * 1.5, "f8", 9), ("rounded", 7, x * 16777217, "i4", 5),
         ("large", 7, x * 1e300, "f8", 9), ("long", 15, x * -1, "i8", 12), ("double", 6, np.full(x.shape, 2**53 + 1), "i8", 12)]
for name, cls, array, stored, kind in cases:
    save(name + ".mat", variable("<", b"x", cls, array, stored, kind))
save("infinite.mat", variable("<", b"x", 7, x * np.inf, "f8", 9))
save("exact.mat", variable("<", b"x", 6, x * 2.0**60, "i8", 12))
)"));
  for (const std::string name : {"wide", "fraction", "rounded", "large", "long", "double"})
    EXPECT_THAT(convert(name + ".mat --as amplitude").err, HasSubstr("values of the variable 'x' do not fit its type"))
        << name;
  EXPECT_EQ(convert("infinite.mat --as amplitude").exit_code, 0);
  EXPECT_EQ(convert("exact.mat --as amplitude").exit_code, 0);
  EXPECT_EQ(frames<float>("amplitude")[0], std::exp2(60.0F));
}

TEST_F(ConvertMatlab, DamagedFilesAreOneError) {
  ASSERT_TRUE(write(R"(
x = np.random.default_rng(8).integers(1, 250, (6, 8, 3))
one = variable("<", b"x", 11, x, "u2", 4)
whole = packed(one)
save("checksum.mat", whole[:-1] + bytes([whole[-1] ^ 1]))
save("twice.mat", one + one)
long = bytearray(one)
long[4:8] = struct.pack("<I", 0xffffffff)  # 4 GiB, of noise
save("announced.mat", packed(bytes(long) + np.random.default_rng(1).bytes(22 << 20)))
value = variable("<", b"", 6, np.ones((1, 1)), "f8", 9)
save("names.mat", packed(structure(b"n" * 5000, 1, b"a" * 4, value * 4)))
save("fields.mat", packed(structure(b"S", 8, b"".join(b"f%07d" % i for i in range(5000)), value * 5000)))
inner = bytearray(value)
inner[4:8] = struct.pack("<I", len(value) - 16)  # the field ends before its value
inside = bytearray(value)
inside[4:8] = struct.pack("<I", 4096)  # the field is longer than its structure
save("beyond.mat", structure(b"S", 8, b"f".ljust(8, b"\0"), bytes(inside)) + one)
save("past.mat", structure(b"S", 8, b"f".ljust(8, b"\0"), bytes(inner)) + one)
)"));
  const std::pair<const char*, const char*> cases[] = {{"checksum", "does not agree with its checksum"},
                                                       {"twice", "two variables 'x'"},
                                                       {"announced", "announces more bytes than it can hold"},
                                                       {"names", "a name of over 4096 characters"},
                                                       {"fields", "more than 4096 variables"},
                                                       {"beyond", "extends beyond the end of its structure"},
                                                       {"past", "announces more values than it holds"}};
  for (const auto& [name, message] : cases) {
    const Outcome outcome = convert(std::string(name) + ".mat --as amplitude");
    EXPECT_EQ(outcome.exit_code, name == cases[0].first ? 1 : 2) << name;  // the checksum comes last
    EXPECT_THAT(outcome.err, HasSubstr(message)) << name;
  }
}

TEST_F(ConvertMatlab, FieldsOfStructuresAreNamedWithDots) {
  if (!python(R"(
import scipy.io
x = np.random.default_rng(6).integers(1, 4000, (6, 8, 5)).astype("u2")
other = {"time": 3.5, "rows": np.array([(1.0,), (2.0,)], dtype=[("a", "f8")]), "empty": np.zeros((0, 3)), "name": "board"}
for name, compressed in [("plain", False), ("packed", True)]:
    content = {"S": {"first": other, "camera": {"amplitude": x, "range": x / 1000.0}, "last": 7}, "t": np.arange(3.0)}
    scipy.io.savemat(name + ".mat", content, do_compression=compressed)
scipy.io.savemat("words.mat", {"S": {"name": "board"}, "T": "text"})
np.moveaxis(x, 2, 0).astype("<f4").tofile("expected.bin")
)"))
    GTEST_SKIP() << "SciPy is not installed";
  for (const std::string name : {"plain.mat", "packed.mat"}) {
    EXPECT_THAT(tofgraph("convert --inspect " + name).out,
                AllOf(HasSubstr("S.camera.range"), HasSubstr("S.first.time"), Not(HasSubstr("rows"))));
    const Outcome outcome = convert(name + " --as amplitude=S.camera.amplitude,range=S.camera.range --unit m");
    ASSERT_EQ(outcome.exit_code, 0) << name << outcome.err;
    EXPECT_EQ(frames<float>("amplitude"), stored<float>("expected.bin")) << name;
    EXPECT_EQ(frames<float>("range")[17], static_cast<float>(stored<float>("expected.bin")[17] / 1000.0)) << name;
  }
  EXPECT_THAT(convert("words.mat --as amplitude").err,
              HasSubstr("no variable that is an array of real numbers; it has: S, T"));
}

}  // namespace
