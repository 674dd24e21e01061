/* SPDX-FileCopyrightText: 2026 The tofgraph authors
 * SPDX-License-Identifier: BSD-3-Clause */
/** @file
 * Extension "effect", version 1, of the plugin border: a piece of the simulator's physics. The rules are those of
 * `tofgraph/plugin.h`. C++ authors include `tofgraph/effect.hpp` instead. */
#ifndef TOFGRAPH_EFFECT_H
#define TOFGRAPH_EFFECT_H

#include <tofgraph/plugin.h>

#ifdef __cplusplus
extern "C" {
#endif

/** Level of an effect. Light passes the levels in this order. */
enum { TOFGRAPH_LEVEL_GEOMETRY = 1, TOFGRAPH_LEVEL_PHASOR = 2, TOFGRAPH_LEVEL_SAMPLES = 3, TOFGRAPH_LEVEL_TAPS = 4 };

/** What an effect belongs to. CAMERA: a correction may undo it; SETUP: the rail, the board, the room. */
enum { TOFGRAPH_SCOPE_CAMERA = 0, TOFGRAPH_SCOPE_SETUP = 1 };

/** Flags of an effect. LATE: phasor: when the light of the level is whole, turns its phase; taps: after the noise, once
 * a frame. IMAGE: looks at neighbours: the points are the pixels, row by row. */
enum { TOFGRAPH_EFFECT_LATE = 1, TOFGRAPH_EFFECT_IMAGE = 2 };

/** Flags of a condition. LASER: the board's distance was read from another instrument than the rail. */
enum { TOFGRAPH_CONDITION_LASER = 1, TOFGRAPH_CONDITION_LENS_CAPPED = 2, TOFGRAPH_CONDITION_RAIL_COVERED = 4 };

/** What is set and known while some frames are taken; unknown: NaN. */
typedef struct tofgraph_condition {
  uint32_t size, flags;
  const char *target, *ambient;                  /* labels; ambient: "dark" or another */
  double integration_time, modulation_frequency; /* s, Hz */
  double temperature, time_since_power_on;       /* K, s */
  double distance, tilt[2], roll; /* m from the sensor plane along the axis; rad; the camera about its axis, rad */
  double velocity;                /* m/s of the board, away positive; NaN: not stated */
} tofgraph_condition;

/** The light of one source, or, where path is null, light from inside the camera. Per point. */
typedef struct tofgraph_source_light {
  const char* name;
  double position[3]; /* m, sensor frame; geometry may change it */
  double on;          /* 1, 0: switched off */
  const double* path; /* m, source to surface */
  double* phasor;     /* real, imaginary: amplitude e^(j phase), counts, at the state's frequency */
  double* strength;   /* counts: the amplitude that counts in the intensity, sum / (2 contrast) */
} tofgraph_source_light;

/** The light of one condition at the effect's level; what a level does not have yet is null or 0. A camera of several
 * frequencies has its geometry and phasor level once for each. */
typedef struct tofgraph_light_state {
  uint32_t size, source_size, exposure_size;
  uint32_t physical; /* not 0: the light falls with angles already */
  const tofgraph_camera* camera;
  const tofgraph_condition* condition;
  double frequency; /* Hz, of the modulation */
  tofgraph_source_light* sources;
  uint64_t source_count;
  /* geometry: what is added to the profile's lens and to what the boards' poses are said to be */
  double distortion[5], principal_point[2]; /* k1 k2 p1 p2 k3, px */
  double scale, offset, tilt[2];            /* z -> (1 + scale) z + offset, m, rad */
  /* phasor: points on surfaces; rows x columns of them where they are the pixels */
  uint64_t points, rows, columns;
  double spacing;                          /* px between neighbours in a row and a column */
  const double *pixel, *ray;               /* 2: column and row, px; 3: unit, optical frame */
  const double *position, *normal;         /* 3: m, sensor frame; 3: unit, towards the camera's side */
  const double *return_path, *sensor_path; /* m: surface to lens centre, lens centre to pixel */
  const double* reflectivity;
  const double *distance, *amplitude; /* late: half of the mean path, not wrapped, m; of all light, counts */
  double* phase_offset;               /* rad, added to the phase at the end of the level */
  /* samples: P exposures; sample k is Re(phasor e^(j phase)) + extra, phase that of exposures[k], which may change */
  tofgraph_exposure* exposures;
  uint64_t exposure_count;
  double *exposure, *intensity, *extra; /* P x points: phasor (real, imaginary); mean of the taps, counts; counts */
  int (*displace)(struct tofgraph_light_state* state, uint32_t exposure, double displacement); /* m, boards, along z */
  /* taps: P x (A, B) x points, counts */
  double* taps;
  double noise_factor; /* of the standard deviation */
} tofgraph_light_state;

/** Data of the extension. Words are blank-separated; all but touches may be "" or null. */
typedef struct tofgraph_effect {
  uint32_t size, level, flags, scope;
  const char* touches;                    /* observables: distance amplitude intensity null1 null2 variance */
  const char *confused_with, *experiment; /* effects that ordinary data cannot tell from it, and what can */
  int (*apply)(void* self, tofgraph_light_state* state); /* [several threads] */
} tofgraph_effect;

#ifdef __cplusplus
}
#endif
#endif
