// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
#include "graph/frame.hpp"

#include <tofgraph/array.hpp>

#include <gtest/gtest.h>

namespace tofgraph::graph {
namespace {

class Frames : public testing::Test {
 protected:
  Frames() {
    fill_frame_calls(host);
    a.pool = b.pool = &pool;
  }
  Array<float> write(tofgraph_frame& frame, const char* name, std::uint64_t rows = 2, std::uint64_t columns = 3) {
    tofgraph_channel channel{};
    channel.size = sizeof channel;
    channel.name = name;
    channel.type = TOFGRAPH_TYPE_F32;
    channel.rank = 2;
    channel.extent[0] = rows;
    channel.extent[1] = columns;
    channel.unit = "m";
    tofgraph_view view = empty_view();
    EXPECT_EQ(host.write(&frame, &channel, &view), TOFGRAPH_STATUS_OK);
    return Array<float>(view);
  }
  tofgraph_host host{};
  BufferPool pool;  // before the frames that use it
  tofgraph_frame a, b;
};

TEST_F(Frames, CopiesShareUntilSomebodyWrites) {
  write(a, "depth")[0] = 1;
  b.channels = a.channels;
  tofgraph_view of_a = empty_view(), of_b = empty_view();
  host.read(&a, "depth", &of_a);
  host.read(&b, "depth", &of_b);
  EXPECT_EQ(of_a.data, of_b.data);
  host.modify(&b, "depth", &of_b);
  EXPECT_NE(of_a.data, of_b.data);
  const Array<float> changed(of_b);
  changed[0] = 2;
  EXPECT_EQ(Array<const float>(of_a)[0], 1.0F);
  tofgraph_view again = empty_view();
  host.modify(&b, "depth", &again);
  EXPECT_EQ(again.data, of_b.data) << "the only holder writes in place";
}

TEST_F(Frames, PoolHandsTheSameBlocksOutAgain) {
  for (int i = 0; i < 100; ++i) {
    write(a, "depth", 204, 204);
    write(a, "sigma", 204, 204);
    a.clear();
  }
  EXPECT_EQ(pool.allocated(), 2U);
}

TEST_F(Frames, LentMemoryIsGivenBackOnce) {
  static int released = 0;
  static float values[6] = {};
  tofgraph_view view = empty_view();
  view.data = values;
  view.type = TOFGRAPH_TYPE_F32;
  view.rank = 2;
  view.extent[0] = 2;
  view.extent[1] = 3;
  view.stride[0] = 12;
  view.stride[1] = 4;
  view.channel = "depth";
  view.unit = "m";
  ASSERT_EQ(host.share(&a, &view, nullptr, [](void*) { ++released; }), TOFGRAPH_STATUS_OK);
  b.channels = a.channels;
  a.clear();
  EXPECT_EQ(released, 0);
  tofgraph_view own = empty_view();
  host.modify(&b, "depth", &own);
  EXPECT_NE(own.data, static_cast<void*>(values)) << "lent memory is never written";
  EXPECT_EQ(released, 0) << "a stage may hold a view of it";
  b.views_ended();
  EXPECT_EQ(released, 1);
  view.stride[0] = 16;  // rows with gaps
  EXPECT_EQ(host.share(&a, &view, nullptr, nullptr), TOFGRAPH_STATUS_ERROR);
}

TEST_F(Frames, ViewsStayGoodUntilTheStageReturns) {
  write(a, "depth")[0] = 1;
  b.channels = a.channels;
  a.clear();
  tofgraph_view held = empty_view();
  for (const std::uint64_t rows : {2000, 300000}) {  // too large for the buffer
    host.read(&b, "depth", &held);
    const float before = Array<const float>(held)[0];
    write(b, "depth", rows)[0] = 2 * before;
    write(b, "sigma", rows - 1)[0] = -1;  // does not receive the memory still in use
    EXPECT_EQ(Array<const float>(held)[0], before);
  }
  host.read(&b, "depth", &held);
  host.drop(&b, "depth");
  write(b, "range", 300000)[0] = -1;
  EXPECT_EQ(Array<const float>(held)[0], 4.0F);
  b.clear();
  const std::size_t allocated = pool.allocated();
  write(b, "depth", 300000);
  EXPECT_EQ(pool.allocated(), allocated) << "and are used again afterwards";
}

TEST_F(Frames, AbsurdExtentsAreRefused) {
  tofgraph_channel channel{};
  channel.size = sizeof channel;
  channel.name = "depth";
  channel.type = TOFGRAPH_TYPE_F32;
  channel.rank = 3;
  channel.extent[0] = channel.extent[1] = channel.extent[2] = std::uint64_t{1} << 40U;
  tofgraph_view view = empty_view();
  EXPECT_EQ(host.write(&a, &channel, &view), TOFGRAPH_STATUS_ERROR);
  channel.rank = 9;
  EXPECT_EQ(host.write(&a, &channel, &view), TOFGRAPH_STATUS_ERROR);
}

}  // namespace
}  // namespace tofgraph::graph
