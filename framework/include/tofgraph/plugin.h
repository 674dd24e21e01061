/* SPDX-FileCopyrightText: 2026 The tofgraph authors
 * SPDX-License-Identifier: BSD-3-Clause */
/** @file
 * Plugin interface: everything that is exchanged between the host and a plugin, in plain C.
 *
 * A plugin is one shared library `tofgraph_KIND_NAME.so` that exports tofgraph_plugin(). C++ authors include
 * `tofgraph/stage.hpp` instead, which fills all of this in from one class; effects have `tofgraph/effect.h` as well.
 *
 * Rules. Every struct that may grow begins with its size, or the array that holds it comes with the size of an
 * element, which is the offset to the next element whatever this header says. A field beyond a size does not exist and
 * counts as 0, null or the value in its comment. The side that creates a struct sets its size, even if the other side
 * fills it in. Fields are added at the end, without gaps, with a new minor version; existing ones keep their place and
 * meaning, so that every plugin of this major version can be loaded.
 *
 * Calls of one stage may come on different threads, one at a time unless stated otherwise; stop() at any time, also
 * more than once. A plugin calls the host on the thread of the call that it is in; stopping() and message() on any.
 * create() is called once, prepare() once after it, destroy() only if create() returned a stage. An element type, kind
 * or flag unknown to a plugin belongs to a later minor version: the plugin refuses what it cannot handle.
 *
 * Strings are UTF-8, end with 0 and are valid as long as the struct they came in, unless stated otherwise. Pointers are
 * not null unless stated otherwise; "" means none. Lengths are in metres, times in seconds, angles in radians,
 * frequencies in hertz, temperatures in kelvin. NaN means unknown. No call may let an exception escape. */
#ifndef TOFGRAPH_PLUGIN_H
#define TOFGRAPH_PLUGIN_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/** A plugin is refused if its major number differs or its minor number is greater than the host's. */
#define TOFGRAPH_API_MAJOR 2u
#define TOFGRAPH_API_MINOR 1u

/** Result of a call. END: a source has no more frames; a filter passes nothing on for this frame. */
enum { TOFGRAPH_STATUS_OK = 0, TOFGRAPH_STATUS_END = 1, TOFGRAPH_STATUS_ERROR = 2 };
/** Type of an element. ANY: unspecified. */
enum { /* clang-format off */
  TOFGRAPH_TYPE_ANY = 0, TOFGRAPH_TYPE_F32 = 1, TOFGRAPH_TYPE_F64 = 2, TOFGRAPH_TYPE_U8 = 3, TOFGRAPH_TYPE_U16 = 4,
  TOFGRAPH_TYPE_I16 = 5, TOFGRAPH_TYPE_I32 = 6
}; /* clang-format on */
/** Direction of a port. */
enum { TOFGRAPH_DIRECTION_IN = 1, TOFGRAPH_DIRECTION_OUT = 2, TOFGRAPH_DIRECTION_INOUT = 3 };
/** Level of a message. */
enum { TOFGRAPH_MESSAGE_INFO = 0, TOFGRAPH_MESSAGE_WARNING = 1 };

/** Flags of a port. OPTIONAL: an input that may be missing, or an output that exists only if provided in prepare.
 * EVERY: stands for all channels of the stream (readers, writers, crop). */
enum { TOFGRAPH_PORT_OPTIONAL = 1, TOFGRAPH_PORT_EVERY = 2 };

/** Flags of a stage. STATELESS: process may run for several frames at once, in any order; otherwise one frame at a
 * time, in the order of the frames. MANY_INPUTS: a sink of any number of streams, with one frame of each. STEADY:
 * after its first frames process allocates memory only through the host; checked by `plugin check`. */
enum { TOFGRAPH_STAGE_STATELESS = 1, TOFGRAPH_STAGE_MANY_INPUTS = 2, TOFGRAPH_STAGE_STEADY = 4 };

/** Kind of a parameter. NUMBER(S) have the unit of the parameter; paths are absolute. OUTPUT_FILE: one per run;
 * FRAME_FILES: one per frame, "out/cloud_{frame:06}.pcd"; IMAGE: pixel values, read by the host. */
enum { /* clang-format off */
  TOFGRAPH_KIND_BOOL = 1, TOFGRAPH_KIND_INTEGER = 2, TOFGRAPH_KIND_NUMBER = 3, TOFGRAPH_KIND_TEXT = 4,
  TOFGRAPH_KIND_CHOICE = 5, TOFGRAPH_KIND_NUMBERS = 6, TOFGRAPH_KIND_INPUT_FILE = 7, TOFGRAPH_KIND_OUTPUT_FILE = 8,
  TOFGRAPH_KIND_FRAME_FILES = 9, TOFGRAPH_KIND_INPUT_FOLDER = 10, TOFGRAPH_KIND_IMAGE = 11
}; /* clang-format on */
/** Flags of a parameter. LIVE: may change between frames, see change(). IN_PLACE: for an INPUT_FILE, its content may
 * be written instead of the path; the text is then YAML, "{..}", with absolute paths. NESTED: for an effect, a
 * refinement that a search varies only if the data require it, with the nonlinear parameters declared after it. */
enum { /* clang-format off */
  TOFGRAPH_PARAMETER_REQUIRED = 1, TOFGRAPH_PARAMETER_LIVE = 2, TOFGRAPH_PARAMETER_IN_PLACE = 4,
  TOFGRAPH_PARAMETER_NESTED = 8
}; /* clang-format on */

/** Lens of a camera. OPENCV: k1 k2 p1 p2 k3, rational and thin prism terms, skew. FISHEYE: `distortion` is k1 k2 k3
 * k4 of OpenCV's fisheye model (Kannala and Brandt), with the skew, and no more. RAYS: only the table `rays` is
 * known; focal length and principal point are those of the best-fitting pinhole. */
enum { TOFGRAPH_LENS_OPENCV = 0, TOFGRAPH_LENS_FISHEYE = 1, TOFGRAPH_LENS_RAYS = 2 };

/** Metadata bits: fields known for every frame of a stream. */
enum { /* clang-format off */
  TOFGRAPH_KNOWS_TIMESTAMP = 1, TOFGRAPH_KNOWS_INTEGRATION_TIME = 2, TOFGRAPH_KNOWS_MODULATION_FREQUENCY = 4,
  TOFGRAPH_KNOWS_TEMPERATURE = 8, TOFGRAPH_KNOWS_TIME_SINCE_POWER_ON = 16
}; /* clang-format on */

/** View of one channel of one frame: the element at (i, j, ..) is at data + i stride[0] + j stride[1] + .. */
typedef struct tofgraph_view {
  uint32_t size, type; /* TOFGRAPH_TYPE_F32 .. */
  uint32_t rank, zero; /* 1 .. 4 */
  void* data;          /* read-only if it came from read() or a parameter */
  uint64_t extent[4];  /* slowest first; rows, columns for an image */
  int64_t stride[4];   /* bytes */
  const char *channel, *unit;
} tofgraph_view;

/** Content of a stream under one name, known before the first frame. All strings except name may be null. */
typedef struct tofgraph_channel {
  uint32_t size, type, rank, zero;
  const char* name;
  uint64_t extent[4];         /* 0: known only with the frame */
  const char *unit, *of;      /* SI: "m", "counts", ""; of: for sigma, the channel whose standard deviation it is */
  const char *applied, *from; /* stages so far, oldest first, and channels it was computed from; blank-separated */
} tofgraph_channel;

typedef struct tofgraph_light {
  const char* name;
  double position[3]; /* m, sensor frame */
  double amplitude;   /* relative */
} tofgraph_light;

/** One of the raw images of a frame: A - B = amplitude cos(Psi + phase), Psi growing with the distance. With the
 * opposite phase convention all phases are negated; exchanged taps add half a turn to all of them. */
typedef struct tofgraph_exposure {
  double phase;     /* rad, step of the demodulation relative to the light */
  double frequency; /* Hz; 0: the frame's modulation frequency */
} tofgraph_exposure;

/** A camera: its profile and the ray of each pixel. */
typedef struct tofgraph_camera {
  uint32_t size, light_size, exposure_size, zero;
  const char* name;
  uint32_t width, height;        /* px */
  double focal_length, pitch[2]; /* m, pitch in x and y; NaN if only known in pixels */
  double focal_px[2];            /* px */
  double principal_point[2];     /* px, 0-based */
  double distortion[5];          /* k1 k2 p1 p2 k3; see TOFGRAPH_LENS_FISHEYE */
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
  const char* profile; /* text of the profile; may be null */
  const tofgraph_exposure* exposures; /* raw images of a frame, in order */
  uint64_t exposure_count;            /* 0: four, 90 degrees apart */
  const char* model;            /* path of the file with the effects that belong to this very camera; may be null */
  double skew;                  /* skew of the axes: u = fx (x + skew y) + cx */
  double further_distortion[7]; /* k4 k5 k6 of the rational model, s1 s2 s3 s4 of a thin prism */
  uint32_t lens_model, zero2;   /* TOFGRAPH_LENS_.. */
} tofgraph_camera;

/** Input of a node, known before the first frame. Valid during prepare; its camera, with lights, rays and profile,
 * as long as the stage. */
typedef struct tofgraph_stream {
  uint32_t size, channel_size, exposure_size, zero;
  const char* node;              /* name of the node it comes from */
  const tofgraph_camera* camera; /* null: unknown */
  const tofgraph_channel* channels;
  uint64_t channel_count;
  uint64_t frames, known;   /* expected number, 0: unknown or endless; TOFGRAPH_KNOWS_.. */
  const char* const* bound; /* channel read by each port of the stage; null: missing */
  uint64_t bound_count;
  const tofgraph_exposure* exposures; /* exposures of the raw images of these frames, in order */
  uint64_t exposure_count;
  const char* source; /* known origin of the frames, as a JSON object */
} tofgraph_stream;

/** Metadata of one frame. */
typedef struct tofgraph_metadata {
  uint32_t size, zero;
  uint64_t number;                               /* index in the run, from 0; set by the host */
  uint64_t device_number;                        /* counter of the device: gaps are lost frames */
  int64_t timestamp_ns;                          /* start of the exposure, since 1970 */
  double integration_time, modulation_frequency; /* s, Hz */
  double temperature, time_since_power_on;       /* K, s */
} tofgraph_metadata;

typedef struct tofgraph_frame tofgraph_frame; /* opaque */

/** Services of the host. `context` is the argument of create(). All calls exist for every kind of plugin; a call
 * that is meaningless for one (an effect has no stream) fails the running call with a message. */
typedef struct tofgraph_host {
  uint32_t size, api_major, api_minor, zero;
  /** Sets the reason before a call returns TOFGRAPH_STATUS_ERROR. parameter: the one at fault, or null. */
  void (*fail)(void* context, const char* parameter, const char* text);
  void (*message)(void* context, uint32_t level, const char* text);
  /** Returns non-zero once the run is ending: a waiting source should return TOFGRAPH_STATUS_END. [any thread] */
  int (*stopping)(void* context);
  /** Returns non-zero if existing files may be replaced (--force, or overwrite: true at the node); see output(). */
  int (*overwrite)(void* context);
  /** In prepare only: announces an output beyond the declared ones. A channel of rank 0 has the description of the
   * output port of that name. A channel of the same name in the input is replaced. */
  void (*provide)(void* context, const tofgraph_channel* channel);
  void (*withdraw)(void* context, const char* channel);
  /** Copies the camera. Rays null: recomputed. Fields beyond its size keep the values of the incoming camera. */
  void (*set_camera)(void* context, const tofgraph_camera* camera);
  /** For sources: sets the camera by its profile's name, or by the profile's text if that is not null. ERROR: no
   * such profile; the stream keeps its camera. */
  int (*use_profile)(void* context, const char* name, const char* profile);
  void (*set_frames)(void* context, uint64_t frames, uint64_t known);
  /** For sources, in prepare: sets the exposures of the raw images if they are not the camera's. Copied. */
  void (*set_exposures)(void* context, const tofgraph_exposure* exposures, uint32_t exposure_size, uint64_t count);
  /** For sources, in prepare: sets the known origin of the frames, as a JSON object, for the
   * provenance. */
  void (*set_source)(void* context, const char* json);
  /** Adds the hash of a file that influences the result to the provenance. In prepare only. The host itself adds
   * images and input files. */
  void (*uses_file)(void* context, const char* path);
  /** Returns the provenance of this node's input as JSON, valid as long as the stage. Waits for hashes of inputs:
   * call it in finish(), and also in prepare(), where it returns {} but starts hashing in the background. */
  const char* (*provenance)(void* context);
  /** Returns the plugin folders of the run in search order, separated by colons; valid as long as the stage. */
  const char* (*plugin_path)(void* context);
  /** In process and finish: creates a file under a temporary name for a parameter (OUTPUT_FILE, FRAME_FILES). If the
   * call returns OK, the host gives the complete file its final name; otherwise it is removed. companion: null, or
   * one of the parameter's `choices`, for a companion file. frame: its number, for FRAME_FILES. path: valid until
   * the call returns. */
  int (*output)(void* context, const char* parameter, const char* companion, uint64_t frame, const char** path);
  /** Access to the channels of a frame. read: shared, read-only. write: memory for the channel, content undefined;
   * the existing buffer if it is not shared. modify: a private copy if the buffer is shared. All return OK, or
   * ERROR if there is no such channel. A view is filled in up to its `size` and is valid until the call returns.
   * share: contiguous memory of the plugin that is no longer written; release(owner), which may be null, is called
   * once after the last reader, on any thread, also after destroy(), but not if share() returned ERROR. */
  int (*read)(tofgraph_frame* frame, const char* channel, tofgraph_view* view);
  int (*write)(tofgraph_frame* frame, const tofgraph_channel* channel, tofgraph_view* view);
  int (*modify)(tofgraph_frame* frame, const char* channel, tofgraph_view* view);
  int (*share)(tofgraph_frame* frame, const tofgraph_view* view, void* owner, void (*release)(void* owner));
  int (*drop)(tofgraph_frame* frame, const char* channel);
  int (*rename)(tofgraph_frame* frame, const char* channel, const char* name);
  tofgraph_metadata* (*metadata)(tofgraph_frame* frame);
  /** Since 2.1. Passes the run as a JSON object to `take`: nodes with inputs, times, parameters; frames; changes so
   * far. `take` is called once, before the call returns. ERROR: nothing runs. [any thread] */
  int (*run_state)(void* context, void (*take)(void* user, const char* json), void* user);
  /** Since 2.1. Changes a LIVE parameter of a node; the value is written as in a pipeline. Waits at most 2 s until
   * no frame is in flight; if the source delivers nothing meanwhile, the change comes with its next frame. `take`
   * is called once: for OK with a JSON object, "frame" being the first number with the new value; for ERROR with
   * the reason. [any thread, but not inside another call of the stage] */
  int (*change_parameter)(void* context, const char* node, const char* parameter, const char* value,
                          void (*take)(void* user, const char* text), void* user);
} tofgraph_host;

/** A port: a channel that a stage reads or writes, with its meaning. Words are blank-separated. name and channel
 * must not be null. */
typedef struct tofgraph_port {
  const char *name, *channel; /* channel: an id, or alternatives "depth|range|distance": the first that
                                 exists, or the one named by a parameter called `channel`; "*" with the flag EVERY */
  const char *shape, *unit;   /* "H W", "P H W", "H W 3", ..: numbers, H and W of the image, P exposures, N; "": any */
  uint32_t type, direction, flags, zero;
  const char *needs,
      *refuses; /* stages or classes of corrections of which one must have been applied; of which none may */
  const char *from, *adds, *of; /* outputs: channels it is computed from; correction classes that it adds
                                   ("non_linearity denoised offset"); for sigma the channel it belongs to */
  const char* text;
} tofgraph_port;

/** A parameter. name must not be null; default_value null: no default. */
typedef struct tofgraph_parameter {
  const char* name;
  uint32_t kind, flags;
  const char *unit, *default_value; /* SI, "" for a pure number, "m|counts|1" for any of these; the default, written as
                                  in a pipeline: "3.91 mm" */
  double minimum, maximum;          /* SI; NaN: no bound */
  const char *choices, *text; /* CHOICE: the words; NUMBER: words allowed besides numbers; output files: endings of
                                 companions; INPUT_FILE: kinds of calibrations taken from a camera's folder;
                                 IMAGE: "mask" if only 0 or non-zero matters; 8-bit pictures are then allowed */
  double off, typical;        /* effects: the value without effect, and a usual size; NaN: none */
} tofgraph_parameter;

/** Value of a parameter; values are in the order of the declaration, `size` bytes apart. */
typedef struct tofgraph_value {
  uint32_t size, given;  /* given: non-zero if the user set it */
  int64_t integer;       /* BOOL, INTEGER */
  double number;         /* NUMBER, SI; NaN if a word was given */
  const char* text;      /* TEXT, CHOICE, paths; for a NUMBER its word, or its unit if several are allowed; else "" */
  const double* numbers; /* NUMBERS; their number is `count` */
  uint64_t count;
  const tofgraph_view* image; /* IMAGE: float64, rows x columns, in SI; of the camera's size in prepare; null: none */
} tofgraph_value;

/** Named struct of an extension; its data begins with its own size. */
typedef struct tofgraph_extension {
  const char* name;
  uint32_t version, zero;
  const void* data;
} tofgraph_extension;

typedef struct tofgraph_descriptor {
  uint32_t size, api_major, api_minor, flags;
  const char *kind, *name;       /* source, filter, sink, effect, format */
  const char *summary, *version; /* summary: one line */
  const char *author, *licence;  /* may be null */
  uint32_t port_size, parameter_size, extension_size, zero;
  const tofgraph_port* ports; /* null if there are none, like the two below */
  uint64_t port_count;
  const tofgraph_parameter* parameters;
  uint64_t parameter_count;
  const tofgraph_extension* extensions;
  uint64_t extension_count;
  /** Creates a stage; null in formats, like the other calls. The values are valid only during the call; host,
   * context and the memory of images as long as the stage. */
  int (*create)(const tofgraph_host* host, void* context, const tofgraph_value* values, void** self);
  /** Checks the input and announces the output. Opens inputs, writes nothing. Sources get one stream without
   * channels, whose camera is the pipeline's or null; so do effects, with the scene's camera. */
  int (*prepare)(void* self, const tofgraph_stream* const* streams, uint64_t count);
  /** One frame: sources fill it, filters change it, sinks store it. [STATELESS: several threads] Null in effects. */
  int (*process)(void* self, tofgraph_frame* const* frames, uint64_t count);
  /** Completes the outputs after the last frame, if nothing failed in this stage, also when the run was interrupted.
   * May be null. */
  int (*finish)(void* self);
  /** Wakes a waiting source. May be null. [any thread] */
  void (*stop)(void* self);
  void (*destroy)(void* self);
  /** Passes all values again, as in create; only LIVE ones may differ. Called between two frames, while no other
   * call of this stage runs. ERROR: the old values are kept. Null if no parameter is LIVE. */
  int (*change)(void* self, const tofgraph_value* values);
} tofgraph_descriptor;

/** Type of the one symbol that a plugin exports. Never fails; the descriptor lives as long as the library. */
typedef const tofgraph_descriptor* (*tofgraph_plugin_function)(void);
#define TOFGRAPH_PLUGIN_SYMBOL "tofgraph_plugin"

#ifdef __cplusplus
}
#endif
#endif
