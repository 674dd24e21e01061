/* SPDX-FileCopyrightText: 2026 The tofgraph authors
 * SPDX-License-Identifier: BSD-3-Clause */
#include <tofgraph/plugin.h>

#include <math.h>
#include <stddef.h>
#include <stdlib.h>

struct stage {
  const tofgraph_host* host;
  void* context;
  float factor;
};

/* Value of parameter i; the host gives the size of a value. */
static const tofgraph_value* value_at(const tofgraph_value* values, size_t i) {
  return (const tofgraph_value*)((const char*)values + i * values->size);
}

static int create(const tofgraph_host* host, void* context, const tofgraph_value* values, void** self) {
  struct stage* stage = malloc(sizeof *stage);
  if (stage == NULL) return TOFGRAPH_STATUS_ERROR;
  stage->host = host;
  stage->context = context;
  stage->factor = (float)value_at(values, 0)->number;
  *self = stage;
  return TOFGRAPH_STATUS_OK;
}

/* Called before the first frame. */
static int prepare(void* self, const tofgraph_stream* const* streams, uint64_t count) {
  (void)self, (void)streams, (void)count;
  return TOFGRAPH_STATUS_OK;
}

/* Called once per frame; several at the same time because of the flag STATELESS below. */
static int process(void* self, tofgraph_frame* const* frames, uint64_t count) {
  const struct stage* stage = self;
  tofgraph_view depth = {sizeof depth, 0, 0, 0, NULL, {0}, {0}, NULL, NULL};
  uint64_t row, column;
  (void)count;
  if (stage->host->modify(frames[0], "depth", &depth) != TOFGRAPH_STATUS_OK) return TOFGRAPH_STATUS_ERROR;
  for (row = 0; row < depth.extent[0]; ++row) {
    for (column = 0; column < depth.extent[1]; ++column) {
      char* pixel = (char*)depth.data + (int64_t)row * depth.stride[0] + (int64_t)column * depth.stride[1];
      *(float*)pixel *= stage->factor;
    }
  }
  return TOFGRAPH_STATUS_OK;
}

static void destroy(void* self) { free(self); }

static const tofgraph_port ports[] = {{"depth", "depth", "H W", "m", TOFGRAPH_TYPE_F32, TOFGRAPH_DIRECTION_INOUT, 0, 0,
                                       "", "", "", "", "", "what is scaled"}};
static const tofgraph_parameter parameters[] = {
    {"factor", TOFGRAPH_KIND_NUMBER, 0, "", "1.01", 0.5, 2, "", "multiplier", NAN, NAN}};

__attribute__((visibility("default"))) const tofgraph_descriptor* tofgraph_plugin(void);
const tofgraph_descriptor* tofgraph_plugin(void) {
  static tofgraph_descriptor d;
  d.size = sizeof d;
  d.api_major = TOFGRAPH_API_MAJOR;
  d.api_minor = TOFGRAPH_API_MINOR;
  d.flags = TOFGRAPH_STAGE_STATELESS;
  d.kind = "filter";
  d.name = TOFGRAPH_PLUGIN_NAME;
  d.version = TOFGRAPH_PLUGIN_VERSION;
  d.summary = "Multiplies the depth by a factor";
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
