/* SPDX-FileCopyrightText: 2026 The tofgraph authors
 * SPDX-License-Identifier: BSD-3-Clause */
#include <tofgraph/plugin.h>

#include <math.h>
#include <stddef.h>
#include <stdlib.h>

struct stage {
  const tofgraph_host* host;
  void* context;
  double speed;
  int64_t frames, next;
  uint64_t rows, columns;
};

/* Value of parameter i; the host gives the size of a value. */
static const tofgraph_value* value_at(const tofgraph_value* values, size_t i) {
  return (const tofgraph_value*)((const char*)values + i * values->size);
}

static int create(const tofgraph_host* host, void* context, const tofgraph_value* values, void** self) {
  struct stage* stage = calloc(1, sizeof *stage);
  if (stage == NULL) return TOFGRAPH_STATUS_ERROR;
  stage->host = host;
  stage->context = context;
  stage->speed = value_at(values, 0)->number;
  stage->frames = value_at(values, 1)->integer;
  *self = stage;
  return TOFGRAPH_STATUS_OK;
}

/* Called before the first frame: announces the number of frames and the metadata that each of them has. */
static int prepare(void* self, const tofgraph_stream* const* streams, uint64_t count) {
  struct stage* stage = self;
  (void)count;
  if (streams[0]->camera == NULL) {
    stage->host->fail(stage->context, NULL, "needs to know the camera: --camera NAME");
    return TOFGRAPH_STATUS_ERROR;
  }
  stage->rows = streams[0]->camera->height;
  stage->columns = streams[0]->camera->width;
  stage->host->set_frames(stage->context, (uint64_t)stage->frames, TOFGRAPH_KNOWS_TIMESTAMP);
  return TOFGRAPH_STATUS_OK;
}

/* Fills one frame. */
static int process(void* self, tofgraph_frame* const* frames, uint64_t count) {
  struct stage* stage = self;
  tofgraph_channel made = {sizeof made, TOFGRAPH_TYPE_F32, 2, 0, "depth", {0}, "m", "", "", ""};
  tofgraph_view depth = {sizeof depth, 0, 0, 0, NULL, {0}, {0}, NULL, NULL};
  uint64_t i;
  (void)count;
  if (stage->next == stage->frames) return TOFGRAPH_STATUS_END;
  made.extent[0] = stage->rows;
  made.extent[1] = stage->columns;
  if (stage->host->write(frames[0], &made, &depth) != TOFGRAPH_STATUS_OK) return TOFGRAPH_STATUS_ERROR;
  for (i = 0; i < stage->rows * stage->columns; ++i)
    ((float*)depth.data)[i] = (float)(1 + (double)stage->next * stage->speed);
  stage->host->metadata(frames[0])->timestamp_ns = stage->next * 10000000;
  ++stage->next;
  return TOFGRAPH_STATUS_OK;
}

static void destroy(void* self) { free(self); }

static const tofgraph_port ports[] = {
    {"depth", "depth", "H W", "m", TOFGRAPH_TYPE_F32, TOFGRAPH_DIRECTION_OUT, 0, 0, "", "", "", "", "", "a wall"}};
static const tofgraph_parameter parameters[] = {
    {"speed", TOFGRAPH_KIND_NUMBER, 0, "m", "10 mm", NAN, NAN, "", "farther away in each frame", NAN, NAN},
    {"frames", TOFGRAPH_KIND_INTEGER, 0, "", "10", 1, NAN, "", "how many", NAN, NAN}};

__attribute__((visibility("default"))) const tofgraph_descriptor* tofgraph_plugin(void);
const tofgraph_descriptor* tofgraph_plugin(void) {
  static tofgraph_descriptor d;
  d.size = sizeof d;
  d.api_major = TOFGRAPH_API_MAJOR;
  d.api_minor = TOFGRAPH_API_MINOR;
  d.kind = "source";
  d.name = TOFGRAPH_PLUGIN_NAME;
  d.version = TOFGRAPH_PLUGIN_VERSION;
  d.summary = "A wall that moves away";
  d.port_size = sizeof ports[0];
  d.ports = ports;
  d.port_count = sizeof ports / sizeof ports[0];
  d.parameter_size = sizeof parameters[0];
  d.parameters = parameters;
  d.parameter_count = sizeof parameters / sizeof parameters[0];
  d.create = create;
  d.prepare = prepare;
  d.process = process;
  d.destroy = destroy;
  return &d;
}
