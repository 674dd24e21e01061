/* SPDX-FileCopyrightText: 2026 The tofgraph authors
 * SPDX-License-Identifier: BSD-3-Clause */
/** @file
 * Extension "effect", version 1, of the plugin interface: part of the simulator's physics. The rules are those of
 * `tofgraph/plugin.h`. C++ authors include `tofgraph/effect.hpp` instead. */
#ifndef TOFGRAPH_EFFECT_H
#define TOFGRAPH_EFFECT_H

#include <tofgraph/plugin.h>

#ifdef __cplusplus
extern "C" {
#endif

/** Level of an effect. Light passes the levels in this order. */
enum { TOFGRAPH_LEVEL_GEOMETRY = 1, TOFGRAPH_LEVEL_PHASOR = 2, TOFGRAPH_LEVEL_SAMPLES = 3, TOFGRAPH_LEVEL_TAPS = 4 };

/** Origin of an effect. CAMERA: a correction may undo it; SETUP: the rail, the board, the room. */
enum { TOFGRAPH_SCOPE_CAMERA = 0, TOFGRAPH_SCOPE_SETUP = 1 };

/** Flags of an effect. LATE: at the phasor level, after all light of the level, to change its phase; at the taps
 * level, after the noise, once per frame. IMAGE: uses neighbours: the points are the pixels, row by row. */
enum { TOFGRAPH_EFFECT_LATE = 1, TOFGRAPH_EFFECT_IMAGE = 2 };

/** Flags of a condition. LASER: the board's distance was measured with another instrument than the rail. */
enum { TOFGRAPH_CONDITION_LASER = 1, TOFGRAPH_CONDITION_LENS_CAPPED = 2, TOFGRAPH_CONDITION_RAIL_COVERED = 4 };

/** Settings and known quantities while frames are taken; unknown: NaN. */
typedef struct tofgraph_condition {
  uint32_t size, flags;
  const char *target, *ambient;                  /* labels; ambient: "dark" or any other word */
  double integration_time, modulation_frequency; /* s, Hz */
  double temperature, time_since_power_on;       /* K, s */
  double distance, tilt[2], roll; /* m from the sensor plane along the axis; rad; camera about its axis, rad */
  double velocity;                /* m/s of the board, positive away from the camera; NaN: not stated */
} tofgraph_condition;

/** Light of one source per point; if path is null, light from inside the camera. */
typedef struct tofgraph_source_light {
  const char* name;
  double position[3]; /* m, sensor frame; geometry may change it */
  double on;          /* 1; 0: switched off */
  const double* path; /* m, source to surface */
  double* phasor;     /* real, imaginary: amplitude e^(j phase), counts, at the state's modulation frequency */
  double* strength;   /* counts: amplitude that contributes to the intensity, sum / (2 contrast) */
} tofgraph_source_light;

/** Light of one condition at the effect's level; members that the level does not provide are null or 0. With several
 * frequencies, the geometry and phasor levels run once for each. */
typedef struct tofgraph_light_state {
  uint32_t size, source_size, exposure_size;
  uint32_t physical; /* not 0: the illumination already depends on the angles */
  const tofgraph_camera* camera;
  const tofgraph_condition* condition;
  double frequency; /* modulation frequency, Hz */
  tofgraph_source_light* sources;
  uint64_t source_count;
  /* geometry: additions to the profile's lens and to the stated poses of the boards */
  double distortion[5], principal_point[2]; /* k1 k2 p1 p2 k3, px */
  double scale, offset, tilt[2];            /* z -> (1 + scale) z + offset, m, rad */
  /* phasor: points on surfaces; rows x columns of them if they are the pixels */
  uint64_t points, rows, columns;
  double spacing;                          /* px between neighbours in a row or column */
  const double *pixel, *ray;               /* 2: column and row, px; 3: unit, optical frame */
  const double *position, *normal;         /* 3: m, sensor frame; 3: unit, facing the camera */
  const double *return_path, *sensor_path; /* m: surface to lens centre, lens centre to pixel */
  const double* reflectivity;
  const double *distance, *amplitude; /* late: half of the mean path, unwrapped, m; of all light, counts */
  double* phase_offset;               /* rad, added to the phase at the end of the level */
  /* samples: P exposures; sample k is Re(phasor e^(j phase)) + extra; the phases in `exposures` may be changed */
  tofgraph_exposure* exposures;
  uint64_t exposure_count;
  double *exposure, *intensity, *extra; /* P x points: phasor (real, imaginary); mean of the taps, counts; counts */
  int (*displace)(struct tofgraph_light_state* state, uint32_t exposure, double displacement); /* m, boards, along z */
  /* taps: P x (A, B) x points, counts */
  double* taps;
  double noise_factor; /* factor on the standard deviation */
  double* removed;     /* P x points: counts taken from each tap that leave their shot noise behind; null: not kept */
} tofgraph_light_state;

/** Data of the extension. Words are separated by blanks; all strings except touches may be "" or null. */
typedef struct tofgraph_effect {
  uint32_t size, level, flags, scope;
  const char* touches;                    /* observables: distance amplitude intensity null1 null2 variance */
  const char *confused_with, *experiment; /* effects that ordinary data cannot distinguish from it; what can */
  int (*apply)(void* self, tofgraph_light_state* state); /* [several threads] */
} tofgraph_effect;

#ifdef __cplusplus
}
#endif
#endif
