// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "python/arrays.hpp"

#include "graph/instance.hpp"
#include "python/run_lock.hpp"

#include <tofgraph/channels.hpp>

#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <stdexcept>

namespace tofgraph::python {
namespace {

struct Type {
  std::uint32_t type;
  py::dtype (*dtype)();
};
constexpr std::array types = {
    Type{TOFGRAPH_TYPE_F32, py::dtype::of<float>},        Type{TOFGRAPH_TYPE_F64, py::dtype::of<double>},
    Type{TOFGRAPH_TYPE_U8, py::dtype::of<std::uint8_t>},  Type{TOFGRAPH_TYPE_U16, py::dtype::of<std::uint16_t>},
    Type{TOFGRAPH_TYPE_I16, py::dtype::of<std::int16_t>}, Type{TOFGRAPH_TYPE_I32, py::dtype::of<std::int32_t>}};

std::vector<std::string> names_of(const auto& channels) {
  std::vector<std::string> names;
  for (const tofgraph_frame::Channel& channel : channels)
    if (channel.buffer) names.push_back(channel.name);
  return names;
}

const tofgraph_frame::Channel& find(const auto& channels, const std::string& name) {
  for (const tofgraph_frame::Channel& channel : channels)
    if (channel.buffer && channel.name == name) return channel;
  std::string text = "the frame has no channel '" + name + "'; it has ";
  for (const std::string& known : names_of(channels)) text += known + " ";
  text.pop_back();
  throw py::key_error(text);
}

/// Does what `array.flags.writeable = False` does, without two calls of Python.
void make_read_only(const py::array& array) {
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
}

/// Releases an array whose memory a channel shares, under the GIL.
void release_array(void* owner) {
  if (Py_IsInitialized() == 0) return;  // the interpreter has ended and freed the array
  const RunLock lock;
  Py_DECREF(static_cast<PyObject*>(owner));
}

/// Calls a function with name, member, bit and meaning of each metadata field that a source may set.
void for_each_metadata(auto&& call) {
  call("device_number", &tofgraph_metadata::device_number, 0U, "counter of the device: gaps are lost frames");
  call("timestamp_ns", &tofgraph_metadata::timestamp_ns, TOFGRAPH_KNOWS_TIMESTAMP + 0U,
       "start of the exposure, ns since 1970");
  call("integration_time", &tofgraph_metadata::integration_time, TOFGRAPH_KNOWS_INTEGRATION_TIME + 0U,
       "s; NaN: unknown");
  call("modulation_frequency", &tofgraph_metadata::modulation_frequency, TOFGRAPH_KNOWS_MODULATION_FREQUENCY + 0U,
       "Hz; NaN: unknown");
  call("temperature", &tofgraph_metadata::temperature, TOFGRAPH_KNOWS_TEMPERATURE + 0U, "K; NaN: unknown");
  call("time_since_power_on", &tofgraph_metadata::time_since_power_on, TOFGRAPH_KNOWS_TIME_SINCE_POWER_ON + 0U,
       "s; NaN: unknown");
}

template <class Class, class Get> void add_metadata(Class& frame, Get get) {
  using Frame = typename Class::type;
  frame.def_property_readonly(
      "number", [get](const Frame& self) { return get(self).number; }, "place in the run, from 0");
  for_each_metadata([&](const char* name, auto member, std::uint32_t /*bit*/, const char* text) {
    frame.def_property_readonly(
        name, [get, member](const Frame& self) { return get(self).*member; }, text);
  });
}

void set_metadata(const StageFrame& frame, const std::string& wanted, const py::object& value) {
  tofgraph_metadata& metadata = frame.get().metadata;
  bool found = false;
  for_each_metadata([&](const char* name, auto member, std::uint32_t /*bit*/, const char* /*text*/) {
    if (wanted != name) return;
    metadata.*member = value.cast<std::remove_reference_t<decltype(metadata.*member)>>();
    found = true;
  });
  if (!found) throw py::key_error("frames have no metadata '" + wanted + "' that a stage may set");
}

}  // namespace

py::dtype dtype_of(std::uint32_t type) {
  const auto found = std::ranges::find(types, type, &Type::type);
  if (found == types.end()) throw py::type_error("a channel's type is unknown to NumPy");
  return found->dtype();
}

std::uint32_t type_of(const py::dtype& dtype) {
  for (const Type& type : types)
    if (dtype.equal(type.dtype())) return type.type;
  throw py::type_error("channels hold float32, float64, uint8, uint16, int16 or int32, not " +
                       py::str(py::handle(dtype)).cast<std::string>());
}

std::uint64_t metadata_bits(const std::vector<std::string>& names) {
  std::uint64_t bits = 0;
  for (const std::string& wanted : names) {
    bool found = false;
    for_each_metadata([&](const char* name, auto /*member*/, std::uint32_t bit, const char* /*text*/) {
      if (wanted == name) found = true, bits |= bit;
    });
    if (!found) throw py::key_error("frames have no metadata '" + wanted + "'");
  }
  return bits;
}

std::string unit_of(const std::string& channel) {
  const ChannelInfo* known = known_channel(channel);
  return known != nullptr ? known->unit : "";
}

py::array array_of(const tofgraph_frame::Channel& channel, Pool pool, bool writable) {
  struct Owner {
    Pool pool;  // before the buffer, which returns to it
    graph::BufferRef buffer;
  };
  const std::vector<py::ssize_t> shape(channel.extent, channel.extent + channel.rank);
  const py::capsule owner(new Owner{std::move(pool), channel.buffer},
                          [](void* held) { delete static_cast<Owner*>(held); });
  py::array array(dtype_of(channel.type), shape, channel.buffer.data(), owner);
  if (!writable) make_read_only(array);
  return array;
}

HeldFrame::HeldFrame(const tofgraph_frame& frame) : pool(frame.pool->shared_from_this()), metadata(frame.metadata) {
  channels.reserve(frame.channels.size());
  std::ranges::copy_if(frame.channels, std::back_inserter(channels),
                       [](const tofgraph_frame::Channel& channel) { return static_cast<bool>(channel.buffer); });
}

tofgraph_frame& StageFrame::get() const {
  if (frame_ == nullptr) throw std::runtime_error("the frame is valid only until process() returns");
  return *frame_;
}

const std::optional<std::string>& StageFrame::unit_to_write(const std::string& channel) const {
  auto found = outputs_->find(channel);
  if (found == outputs_->end()) found = outputs_->find("*");
  if (found == outputs_->end())
    throw py::type_error("the stage does not declare that it writes '" + channel + "', e.g. " + channel +
                         " = tg.InOut(\"" + channel + "\")");
  return found->second;
}

void StageFrame::set(const std::string& channel, const py::object& object) const {
  tofgraph_frame& frame = get();
  const std::optional<std::string>& own = unit_to_write(channel);
  if (!py::isinstance<py::array>(object))
    throw py::type_error("channel '" + channel + "' takes a NumPy array, not " +
                         py::str(py::type::of(object).attr("__name__")).cast<std::string>());
  const auto given = py::reinterpret_borrow<py::array>(object);
  if (given.ndim() < 1 || given.ndim() > 4)
    throw py::value_error("channel '" + channel + "' has one to four dimensions, the array has " +
                          std::to_string(given.ndim()));
  if (py::isinstance(given, py::module_::import("numpy.ma").attr("MaskedArray")))
    throw py::type_error("channel '" + channel + "': a masked array has no place for its mask; use .filled(numpy.nan)");
  const std::uint32_t type = type_of(given.dtype());
  const bool whole = (given.flags() & py::array::c_style) != 0 && given.owndata();
  py::array array = whole ? given : py::array(given.attr("copy")("C"));
  make_read_only(array);  // the frame owns it now
  tofgraph_view view{};
  view.size = sizeof view;
  view.type = type;
  view.rank = static_cast<std::uint32_t>(array.ndim());
  view.data = const_cast<void*>(array.data());  // NOLINT(*-const-cast): shared channels are read-only
  for (py::ssize_t i = 0; i < array.ndim(); ++i) {
    view.extent[i] = static_cast<std::uint64_t>(array.shape(i));
    view.stride[i] = array.strides(i);
  }
  view.channel = channel.c_str();
  const tofgraph_frame::Channel* present = frame.find(channel);
  const std::string unit = own ? *own : present != nullptr ? present->unit : unit_of(channel);
  view.unit = unit.c_str();
  PyObject* owner = array.inc_ref().ptr();
  if (graph::host_table().share(&frame, &view, owner, release_array) == TOFGRAPH_STATUS_OK) return;
  Py_DECREF(owner);
  throw std::runtime_error("channel '" + channel + "' cannot be set");
}

py::array StageFrame::modify(const std::string& channel) const {
  tofgraph_frame& frame = get();
  static_cast<void>(unit_to_write(channel));
  const tofgraph_frame::Channel& now = find(frame.channels, channel);
  // A second call to modify() would see the first array as another reader and copy the channel.
  if (const auto lent = modified_.find(channel); lent != modified_.end() && lent->second.data() == now.buffer.data())
    return lent->second;
  tofgraph_view view{};
  view.size = sizeof view;
  if (graph::host_table().modify(&frame, channel.c_str(), &view) != TOFGRAPH_STATUS_OK)
    throw std::runtime_error("channel '" + channel + "' cannot be changed");
  return modified_[channel] = array_of(*frame.find(channel), frame.pool->shared_from_this(), true);
}

void StageFrame::end() {
  for (const auto& [name, array] : modified_) make_read_only(array);
  modified_.clear();
  frame_ = nullptr;
}

void add_frames(py::module_& module) {
  py::class_<HeldFrame, std::shared_ptr<HeldFrame>> held(module, "Frame",
                                                         "A frame that left a node: channels as read-only NumPy arrays "
                                                         "that share the pipeline's memory, and metadata.");
  held.def("__getitem__",
           [](const HeldFrame& f, const std::string& name) { return array_of(find(f.channels, name), f.pool, false); });
  held.def(
      "take",
      [](const HeldFrame& f, const std::string& name) {
        return array_of(find(f.channels, name), f.pool, false).attr("copy")();
      },
      py::arg("channel"), "A copy of a channel that may be written.");
  held.def("__contains__", [](const HeldFrame& f, const std::string& name) {
    return std::ranges::any_of(f.channels, [&](const auto& channel) { return channel.name == name; });
  });
  held.def(
      "unit", [](const HeldFrame& f, const std::string& name) { return find(f.channels, name).unit; },
      py::arg("channel"), "Unit of a channel, e.g. 'm' or 'counts'; '' for pure numbers.");
  held.def_property_readonly(
      "channels", [](const HeldFrame& f) { return names_of(f.channels); }, "Names of the channels.");
  held.def("__iter__", [](const HeldFrame& f) { return py::iter(py::cast(names_of(f.channels))); });
  held.def("__len__", [](const HeldFrame& f) { return f.channels.size(); });
  add_metadata(held, [](const HeldFrame& f) -> const tofgraph_metadata& { return f.metadata; });

  py::class_<StageFrame> stage(module, "StageFrame", "A frame during process() of a stage.");
  stage.def("__getitem__", [](const StageFrame& f, const std::string& name) {
    return array_of(find(f.get().channels, name), f.get().pool->shared_from_this(), false);
  });
  stage.def("__setitem__", &StageFrame::set);
  stage.def("modify", &StageFrame::modify, py::arg("channel"),
            "The channel as an array that may be written until process() returns.");
  stage.def(
      "drop",
      [](const StageFrame& f, const std::string& name) {
        static_cast<void>(find(f.get().channels, name));
        graph::host_table().drop(&f.get(), name.c_str());
      },
      py::arg("channel"), "Removes a channel.");
  stage.def("__contains__", [](const StageFrame& f, const std::string& name) {
    const auto* channel = f.get().find(name);
    return channel != nullptr && static_cast<bool>(channel->buffer);
  });
  stage.def_property_readonly(
      "channels", [](const StageFrame& f) { return names_of(f.get().channels); }, "Names of the channels.");
  stage.def("set_metadata", &set_metadata, py::arg("name"), py::arg("value"),
            "Sets a field of the metadata; for sources.");
  add_metadata(stage, [](const StageFrame& f) -> const tofgraph_metadata& { return f.get().metadata; });
}

}  // namespace tofgraph::python
