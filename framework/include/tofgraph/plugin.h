/* SPDX-FileCopyrightText: 2026 The tofgraph authors
 * SPDX-License-Identifier: BSD-3-Clause */
/** @file
 * The plugin border: everything that passes between the host and a plugin, in plain C.
 *
 * A plugin is one shared library `tofgraph_KIND_NAME.so` that exports tofgraph_plugin(). C++ authors include
 * `tofgraph/stage.hpp` instead, which fills all of this in from one class.
 *
 * Rules. Every struct that may grow carries its size (arrays: the size of an element beside the pointer); a field
 * beyond that size does not exist. Strings are UTF-8, end with 0 and, if not said otherwise, live as long as the
 * struct they came in. Lengths are in metre, times in second, angles in radian, frequencies in hertz, temperatures
 * in kelvin, everywhere. NaN is "unknown". No call may let a C++ exception out. */
#ifndef TOFGRAPH_PLUGIN_H
#define TOFGRAPH_PLUGIN_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/** A plugin is refused when its major number differs or its minor number is greater than the host's. */
#define TOFGRAPH_API_MAJOR 1u
#define TOFGRAPH_API_MINOR 0u

/** What a call returns. END: a source has no more frames; of a filter nothing leaves for this frame. */
enum { TOFGRAPH_OK = 0, TOFGRAPH_END = 1, TOFGRAPH_ERROR = 2 };
enum { TOFGRAPH_ANY = 0, TOFGRAPH_F32, TOFGRAPH_F64, TOFGRAPH_U8, TOFGRAPH_U16, TOFGRAPH_I16, TOFGRAPH_I32 };
enum { TOFGRAPH_IN = 1, TOFGRAPH_OUT = 2, TOFGRAPH_INOUT = 3 }; /* direction of a port */
enum { TOFGRAPH_INFO = 0, TOFGRAPH_WARNING = 1 };               /* level of a message */

/** Flags of a port. OPTIONAL: an input that may be missing, an output that is there only when provided in prepare.
 * EVERY: stands for all channels of the stream (readers, writers, crop). */
enum { TOFGRAPH_OPTIONAL = 1, TOFGRAPH_EVERY = 2 };

/** Flags of a stage. STATELESS: process may run for several frames at once, in any order; otherwise one frame at a
 * time, in the order of the frames. MANY_INPUTS: takes any number of streams and gets one frame of each. */
enum { TOFGRAPH_STATELESS = 1, TOFGRAPH_MANY_INPUTS = 2 };

/** Kinds of parameters. NUMBER(S) have the unit of the parameter; PATHs come absolute. */
enum { TOFGRAPH_BOOL = 1, TOFGRAPH_INTEGER, TOFGRAPH_NUMBER, TOFGRAPH_TEXT, TOFGRAPH_CHOICE, TOFGRAPH_NUMBERS };
enum { TOFGRAPH_INPUT_FILE = 7, TOFGRAPH_OUTPUT_FILE };

/** Metadata bits: what is known of every frame of a stream. */
enum { TOFGRAPH_KNOWS_TIMESTAMP = 1, TOFGRAPH_KNOWS_INTEGRATION_TIME = 2, TOFGRAPH_KNOWS_MODULATION_FREQUENCY = 4 };
enum { TOFGRAPH_KNOWS_TEMPERATURE = 8, TOFGRAPH_KNOWS_TIME_SINCE_POWER_ON = 16 };

/** A plain view of one channel of one frame: the element at (i, j, ..) is at data + i stride[0] + j stride[1] + .. */
typedef struct tofgraph_view {
  void* data;         /* read-only where it came from read() */
  uint32_t type;      /* TOFGRAPH_F32 .. */
  uint32_t rank;      /* 1 .. 4 */
  uint64_t extent[4]; /* slowest first; for an image rows, columns */
  int64_t stride[4];  /* bytes */
  const char *channel, *unit;
} tofgraph_view;

/** What a stream carries under one name, known before the first frame. */
typedef struct tofgraph_channel {
  const char* name;
  uint32_t type, rank;
  uint64_t extent[4];         /* 0: known only with the frame */
  const char *unit, *of;      /* SI: "m", "counts", ""; of: for sigma, the channel whose standard deviation it is */
  const char *applied, *from; /* stages so far, oldest first, and channels it was computed from; blank-separated */
} tofgraph_channel;

typedef struct tofgraph_light {
  const char* name;
  double position[3]; /* m, sensor frame */
  double amplitude;   /* relative */
} tofgraph_light;

/** A camera: its profile, and the ray of each pixel. */
typedef struct tofgraph_camera {
  uint32_t size, light_size;
  const char* name;
  uint32_t width, height;        /* px */
  double focal_length, pitch[2]; /* m, pitch in x and y; NaN when only known in pixels */
  double focal_px[2];            /* px */
  double principal_point[2];     /* px, 0-based */
  double distortion[5];          /* k1 k2 p1 p2 k3 */
  double modulation_frequency;   /* Hz, nominal */
  double integration_time[2];    /* s, valid range */
  double frame_rate;             /* Hz */
  double gain, contrast; /* amplitude = gain reflectivity t_int / D_t^2, in counts m^2/s; contrast of the taps */
  double read_noise;     /* counts, standard deviation of a tap */
  double shot_noise;     /* variance per count */
  double full_well;      /* counts of a tap */
  const tofgraph_light* lights;
  uint64_t light_count;
  const float* rays;   /* height x width x 3 unit vectors in the optical frame; NaN outside the lens model */
  const char* profile; /* text of the profile */
} tofgraph_camera;

/** What arrives at a node, known before the first frame. */
typedef struct tofgraph_stream {
  uint32_t size, channel_size;
  const char* node; /* the node it comes from */
  const tofgraph_camera* camera;
  const tofgraph_channel* channels;
  uint64_t channel_count;
  uint64_t frames, known;   /* how many will come, 0: unknown or endless; TOFGRAPH_KNOWS_.. */
  const char* const* bound; /* for each port of the stage the channel that it reads; null: not there */
  uint64_t bound_count;
} tofgraph_stream;

/** Metadata of one frame. */
typedef struct tofgraph_metadata {
  uint32_t size, reserved;
  uint64_t number;                               /* place in the run, from 0; set by the host */
  uint64_t device_number;                        /* the device's own counter: gaps are lost frames */
  int64_t timestamp_ns;                          /* start of the exposure, since 1970 */
  double integration_time, modulation_frequency; /* s, Hz */
  double temperature, time_since_power_on;       /* K, s */
} tofgraph_metadata;

typedef struct tofgraph_frame tofgraph_frame; /* the host's */

/** Services of the host. `context` is what create() was given. */
typedef struct tofgraph_host {
  uint32_t size, api_major, api_minor, reserved;
  /** Says why the call is about to return TOFGRAPH_ERROR; parameter: the one at fault, or null. */
  void (*fail)(void* context, const char* parameter, const char* text);
  void (*message)(void* context, uint32_t level, const char* text);
  /** Not 0 once the run is ending: a source that waits should return TOFGRAPH_END. [any thread] */
  int (*stopping)(void* context);
  /** Not 0 when existing files may be replaced (--force). */
  int (*overwrite)(void* context);
  /** In prepare only: what the stage hands on, where that is more than its declared outputs. */
  void (*provide)(void* context, const tofgraph_channel* channel);
  void (*withdraw)(void* context, const char* channel);
  void (*set_camera)(void* context, const tofgraph_camera* camera); /* copied; rays may be null: made anew */
  /** For sources: the camera by its profile's name, or by the profile's text where that is not null. ERROR: there
   * is no such profile; the stream then has no camera. */
  int (*use_profile)(void* context, const char* name, const char* profile);
  void (*set_frames)(void* context, uint64_t frames, uint64_t known);
  /** A file whose content shapes the result: its hash goes into the provenance. In prepare only. */
  void (*uses_file)(void* context, const char* path);
  /** The provenance of what arrives at this node, as JSON; valid until the next call. */
  const char* (*provenance)(void* context);
  /** The channels of a frame. read: shared, do not write. write: a new buffer, content undefined. modify: a
   * private copy where the buffer is shared. All return TOFGRAPH_OK, or TOFGRAPH_ERROR when there is none. */
  int (*read)(tofgraph_frame* frame, const char* channel, tofgraph_view* view);
  int (*write)(tofgraph_frame* frame, const tofgraph_channel* channel, tofgraph_view* view);
  int (*modify)(tofgraph_frame* frame, const char* channel, tofgraph_view* view);
  int (*share)(tofgraph_frame* frame, const tofgraph_view* view, void* owner, void (*release)(void* owner));
  int (*drop)(tofgraph_frame* frame, const char* channel);
  tofgraph_metadata* (*metadata)(tofgraph_frame* frame);
} tofgraph_host;

/** A port: what a stage reads or makes, with its meaning. Words are blank-separated. */
typedef struct tofgraph_port {
  const char *name, *channel; /* channel: an id, or alternatives "depth|range|distance": the first that is there, or the
                                 one named by a parameter called `channel` */
  const char *shape, *unit;   /* "H W", "4 H W", "H W 3", ..; "" any */
  uint32_t type, direction, flags;
  const char *needs, *refuses;  /* stages one of which must have been applied to it; that must not have been */
  const char *from, *adds, *of; /* outputs: channels it is computed from; words added to `applied` besides the stage's
                                   name (a class of corrections); for sigma the channel it belongs to */
  const char* text;
} tofgraph_port;

typedef struct tofgraph_parameter {
  const char* name;
  uint32_t kind, required;
  const char *unit, *fallback; /* SI, "" for a pure number, "m|counts|1" for any of these; the default, written as in a
                                  pipeline: "3.91 mm", or null */
  double minimum, maximum;     /* SI; NaN: no bound */
  const char *choices, *text;  /* CHOICE: the words; NUMBER: words allowed instead of a number, e.g. "auto" */
  double off, typical;         /* effects: the value that changes nothing, and a usual size */
} tofgraph_parameter;

/** The value of a parameter, in the order of the declaration. */
typedef struct tofgraph_value {
  int64_t integer;       /* BOOL, INTEGER */
  double number;         /* NUMBER, SI; NaN when a word was given */
  const char* text;      /* TEXT, CHOICE, files, the word of a NUMBER, or its unit of several; else "" */
  const double* numbers; /* NUMBERS, so many: */
  uint64_t count, given; /* given: not 0 when the user wrote it */
} tofgraph_value;

/** A named struct beyond the plain stage; data begins with its own size. */
typedef struct tofgraph_extension {
  const char* name;
  uint32_t version, reserved;
  const void* data;
} tofgraph_extension;

/** Extension "effect", version 1: a piece of the simulator's physics. Light passes the levels in this order. */
enum { TOFGRAPH_GEOMETRY = 1, TOFGRAPH_PHASOR, TOFGRAPH_SAMPLES, TOFGRAPH_TAPS };

/** Flags of an effect. LATE: phasor: when the light of the level is whole, turns its phase; taps: after the noise, once
 * a frame. IMAGE: looks at neighbours: the points are the pixels, row by row. */
enum { TOFGRAPH_LATE = 1, TOFGRAPH_IMAGE = 2 };

/** Flags of a condition. LASER: the board's distance was read from another instrument than the rail. */
enum { TOFGRAPH_LASER = 1, TOFGRAPH_LENS_CAPPED = 2, TOFGRAPH_RAIL_COVERED = 4 };

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
  double* phasor;     /* real, imaginary: amplitude e^(j phase), counts */
  double* strength;   /* counts: the amplitude that counts in the intensity, sum / (2 contrast) */
} tofgraph_source_light;

/** The light of one condition at the effect's level; what a level does not have yet is null or 0. */
typedef struct tofgraph_light_state {
  uint32_t size, source_size;
  const tofgraph_camera* camera;
  const tofgraph_condition* condition;
  uint32_t physical, source_count; /* not 0: the light falls with angles already */
  tofgraph_source_light* sources;
  /* geometry: what is added to the profile's lens and to what the boards' poses are said to be */
  double distortion[5], principal_point[2]; /* k1 k2 p1 p2 k3, px */
  double scale, offset, tilt[2];            /* z -> (1 + scale) z + offset, m, rad */
  /* phasor: points on surfaces; rows x columns of them where they are the pixels */
  uint64_t points, rows, columns;
  double spacing;                   /* px between neighbours in a row and a column */
  const double *pixel, *ray;        /* 2: column and row, px; 3: unit, optical frame */
  const double *position, *normal;  /* 3: m, sensor frame; 3: unit, towards the camera's side */
  const double *reflected, *inside; /* m: surface to lens centre, lens centre to pixel */
  const double* reflectivity;
  const double *distance, *amplitude; /* late: half of the mean path, not wrapped, m; of all light, counts */
  double* turn;                       /* rad, added to the phase at the end of the level */
  /* samples: four exposures; sample k is Re(phasor e^(j step)) + extra */
  double *exposure, *intensity, *extra; /* 4 x points: phasor (real, imaginary); mean of the taps, counts; counts */
  double step[4];                       /* rad: k pi/2 */
  int (*displace)(struct tofgraph_light_state* state, uint32_t exposure, double displacement); /* m, boards, along z */
  /* taps: 4 x (A, B) x points, counts */
  double* taps;
  double noise_factor; /* of the standard deviation */
} tofgraph_light_state;

typedef struct tofgraph_effect {
  uint32_t size, level, flags, reserved;
  const char* touches;                    /* observables: distance amplitude intensity null1 null2 variance */
  const char *confused_with, *experiment; /* effects that ordinary data cannot tell from it, and what can */
  int (*apply)(void* self, tofgraph_light_state* state); /* [several threads] */
} tofgraph_effect;

typedef struct tofgraph_descriptor {
  uint32_t size, api_major, api_minor, flags;
  const char *kind, *name;       /* source, filter, sink, effect */
  const char *summary, *version; /* summary: one line */
  uint32_t port_size, parameter_size, extension_size, reserved;
  const tofgraph_port* ports;
  uint64_t port_count;
  const tofgraph_parameter* parameters;
  uint64_t parameter_count;
  const tofgraph_extension* extensions;
  uint64_t extension_count;
  /** Makes a stage. The values live only during the call; host and context as long as the stage. */
  int (*create)(const tofgraph_host* host, void* context, const tofgraph_value* values, void** self);
  /** Checks what arrives and says what leaves. Opens inputs, writes nothing. Sources get one stream without
   * channels, whose camera is the pipeline's or null; so do effects, with the scene's. */
  int (*prepare)(void* self, const tofgraph_stream* const* streams, uint64_t count);
  /** One frame: sources fill it, filters change it, sinks store it. [STATELESS: several threads] Null in effects. */
  int (*process)(void* self, tofgraph_frame* const* frames, uint64_t count);
  /** After the last frame, if nothing failed in this stage: complete the outputs. May be null. */
  int (*finish)(void* self);
  /** Wakes a source that waits. May be null. [any thread] */
  void (*stop)(void* self);
  void (*destroy)(void* self);
} tofgraph_descriptor;

/** The one symbol that a plugin exports. Never fails; the descriptor lives as long as the library. */
typedef const tofgraph_descriptor* (*tofgraph_plugin_function)(void);
#define TOFGRAPH_PLUGIN_SYMBOL "tofgraph_plugin"

#ifdef __cplusplus
}
#endif
#endif
