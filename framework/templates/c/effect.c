/* SPDX-FileCopyrightText: 2026 The tofgraph authors
 * SPDX-License-Identifier: BSD-3-Clause */
#include <tofgraph/effect.h>

#include <math.h>
#include <stddef.h>
#include <stdlib.h>

struct effect {
  double size;
};

static int create(const tofgraph_host* host, void* context, const tofgraph_value* values, void** self) {
  struct effect* effect = malloc(sizeof *effect);
  (void)host, (void)context;
  if (effect == NULL) return TOFGRAPH_STATUS_ERROR;
  effect->size = values->number;
  *self = effect;
  return TOFGRAPH_STATUS_OK;
}

static int prepare(void* self, const tofgraph_stream* const* streams, uint64_t count) {
  (void)self, (void)streams, (void)count;
  return TOFGRAPH_STATUS_OK;
}

/* Changes the phase of all light; radians per metre of distance: 4 pi f / c. */
static int apply(void* self, tofgraph_light_state* light) {
  const struct effect* effect = self;
  const double radians_per_metre = 4 * 3.14159265358979323846 / 299792458.0 * light->frequency;
  uint64_t i;
  for (i = 0; i < light->points; ++i) light->phase_offset[i] += radians_per_metre * effect->size;
  return TOFGRAPH_STATUS_OK;
}

static void destroy(void* self) { free(self); }

/* The last two: the value without effect, and the value that a search tries first. */
static const tofgraph_parameter parameters[] = {
    {"size", TOFGRAPH_KIND_NUMBER, 0, "m", "0 mm", -1, 1, "", "added to the distance", 0, 0.01}};
static const tofgraph_effect effect_data = {sizeof effect_data,
                                            TOFGRAPH_LEVEL_PHASOR,
                                            TOFGRAPH_EFFECT_LATE,
                                            TOFGRAPH_SCOPE_CAMERA,
                                            "distance",
                                            "zero_offset",
                                            "",
                                            apply};
static const tofgraph_extension extension = {"effect", 1, 0, &effect_data};

__attribute__((visibility("default"))) const tofgraph_descriptor* tofgraph_plugin(void);
const tofgraph_descriptor* tofgraph_plugin(void) {
  static tofgraph_descriptor d;
  d.size = sizeof d;
  d.api_major = TOFGRAPH_API_MAJOR;
  d.api_minor = TOFGRAPH_API_MINOR;
  d.kind = "effect";
  d.name = TOFGRAPH_PLUGIN_NAME;
  d.version = TOFGRAPH_PLUGIN_VERSION;
  d.summary = "The same error of the distance everywhere";
  d.parameter_size = sizeof parameters[0];
  d.parameters = parameters;
  d.parameter_count = sizeof parameters / sizeof parameters[0];
  d.extension_size = sizeof extension;
  d.extensions = &extension;
  d.extension_count = 1;
  d.create = create;
  d.prepare = prepare;
  d.destroy = destroy;
  return &d;
}
