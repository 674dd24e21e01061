/* SPDX-FileCopyrightText: 2026 The tofgraph authors
 * SPDX-License-Identifier: BSD-3-Clause */
#include <tofgraph/plugin.h>

#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>

struct stage {
  const tofgraph_host* host;
  void* context;
  double* means;
  size_t count, capacity;
};

static int create(const tofgraph_host* host, void* context, const tofgraph_value* values, void** self) {
  struct stage* stage = calloc(1, sizeof *stage);
  (void)values;
  if (stage == NULL) return TOFGRAPH_STATUS_ERROR;
  stage->host = host;
  stage->context = context;
  *self = stage;
  return TOFGRAPH_STATUS_OK;
}

/* Called before the first frame. */
static int prepare(void* self, const tofgraph_stream* const* streams, uint64_t count) {
  (void)self, (void)streams, (void)count;
  return TOFGRAPH_STATUS_OK;
}

/* Called once per frame, one at a time, in order. */
static int process(void* self, tofgraph_frame* const* frames, uint64_t count) {
  struct stage* stage = self;
  tofgraph_view depth = {sizeof depth, 0, 0, 0, NULL, {0}, {0}, NULL, NULL};
  uint64_t row, column;
  double sum = 0, valid = 0;
  (void)count;
  if (stage->host->read(frames[0], "depth", &depth) != TOFGRAPH_STATUS_OK) return TOFGRAPH_STATUS_ERROR;
  for (row = 0; row < depth.extent[0]; ++row) {
    for (column = 0; column < depth.extent[1]; ++column) {
      const char* pixel = (const char*)depth.data + (int64_t)row * depth.stride[0] + (int64_t)column * depth.stride[1];
      const float z = *(const float*)pixel;
      if (isnan(z)) continue; /* an invalid pixel */
      sum += (double)z;
      ++valid;
    }
  }
  if (stage->count == stage->capacity) {
    const size_t capacity = 2 * stage->capacity + 64;
    double* means = realloc(stage->means, capacity * sizeof *means);
    if (means == NULL) return TOFGRAPH_STATUS_ERROR;
    stage->means = means;
    stage->capacity = capacity;
  }
  stage->means[stage->count++] = sum / valid;
  return TOFGRAPH_STATUS_OK;
}

/* Called after the last frame. The host renames the file to its final name after this returned OK. */
static int finish(void* self) {
  struct stage* stage = self;
  const char* path = NULL;
  FILE* out;
  size_t i;
  if (stage->host->output(stage->context, "path", NULL, 0, &path) != TOFGRAPH_STATUS_OK) return TOFGRAPH_STATUS_ERROR;
  out = fopen(path, "w");
  if (out == NULL) {
    stage->host->fail(stage->context, "path", "the file cannot be written");
    return TOFGRAPH_STATUS_ERROR;
  }
  fprintf(out, "frame,mean_m\n");
  for (i = 0; i < stage->count; ++i) fprintf(out, "%zu,%g\n", i, stage->means[i]);
  if (fclose(out) == 0) return TOFGRAPH_STATUS_OK;
  stage->host->fail(stage->context, "path", "the file cannot be written");
  return TOFGRAPH_STATUS_ERROR;
}

static void destroy(void* self) {
  struct stage* stage = self;
  free(stage->means);
  free(stage);
}

static const tofgraph_port ports[] = {
    {"depth", "depth", "H W", "m", TOFGRAPH_TYPE_F32, TOFGRAPH_DIRECTION_IN, 0, 0, "", "", "", "", "", "what is read"}};
static const tofgraph_parameter parameters[] = {{"path", TOFGRAPH_KIND_OUTPUT_FILE, TOFGRAPH_PARAMETER_REQUIRED, "",
                                                 NULL, NAN, NAN, "", "the table, e.g. out/means.csv", NAN, NAN}};

__attribute__((visibility("default"))) const tofgraph_descriptor* tofgraph_plugin(void);
const tofgraph_descriptor* tofgraph_plugin(void) {
  static tofgraph_descriptor d;
  d.size = sizeof d;
  d.api_major = TOFGRAPH_API_MAJOR;
  d.api_minor = TOFGRAPH_API_MINOR;
  d.kind = "sink";
  d.name = TOFGRAPH_PLUGIN_NAME;
  d.version = TOFGRAPH_PLUGIN_VERSION;
  d.summary = "Mean depth of each frame as a table";
  d.port_size = sizeof ports[0];
  d.ports = ports;
  d.port_count = sizeof ports / sizeof ports[0];
  d.parameter_size = sizeof parameters[0];
  d.parameters = parameters;
  d.parameter_count = sizeof parameters / sizeof parameters[0];
  d.create = create;
  d.prepare = prepare;
  d.process = process;
  d.finish = finish;
  d.destroy = destroy;
  return &d;
}
