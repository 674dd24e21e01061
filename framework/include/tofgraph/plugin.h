/* SPDX-FileCopyrightText: 2026 The tofgraph authors
 * SPDX-License-Identifier: BSD-3-Clause */
/** @file
 * The plugin border: everything that passes between the host and a plugin, in plain C.
 *
 * A plugin is one shared library `tofgraph_KIND_NAME.so` that exports tofgraph_plugin(). C++ authors include
 * `tofgraph/stage.hpp` instead, which fills all of this in from one class; effects have `tofgraph/effect.h` as well.
 *
 * Rules. Every struct that may grow begins with its size, or the array that holds it has the size of an element beside
 * it: the next element is that many bytes further, whatever this header says. A field beyond a size does not exist and
 * counts as 0, null or what its comment says. Whoever makes a struct sets its size, also where the other side fills it
 * in. Fields are added at the end, without gaps, with a new minor version; what exists keeps its place and meaning, so
 * that a plugin of this major version is loaded for good.
 *
 * Calls of one stage may come on different threads, one at a time if not said otherwise; stop() at any time, also more
 * than once. A plugin calls the host on the thread of the call that it is in; stopping() and message() on any. create()
 * comes once, prepare() once after it, destroy() only where create() gave something. An element type, kind or flag that
 * a plugin does not know is one of a later minor version: it refuses what it cannot handle.
 *
 * Strings are UTF-8, end with 0 and live as long as the struct they came in, if not said otherwise. Pointers are not
 * null, if not said otherwise; "" stands for nothing. Lengths are in metre, times in second, angles in radian,
 * frequencies in hertz, temperatures in kelvin, everywhere. NaN is "unknown". No call may let an exception out. */
#ifndef TOFGRAPH_PLUGIN_H
#define TOFGRAPH_PLUGIN_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/** A plugin is refused when its major number differs or its minor number is greater than the host's. */
#define TOFGRAPH_API_MAJOR 2u
#define TOFGRAPH_API_MINOR 1u

/** What a call returns. END: a source has no more frames; of a filter nothing leaves for this frame. */
enum { TOFGRAPH_STATUS_OK = 0, TOFGRAPH_STATUS_END = 1, TOFGRAPH_STATUS_ERROR = 2 };
/** Type of an element. ANY: not told. */
enum { /* clang-format off */
  TOFGRAPH_TYPE_ANY = 0, TOFGRAPH_TYPE_F32 = 1, TOFGRAPH_TYPE_F64 = 2, TOFGRAPH_TYPE_U8 = 3, TOFGRAPH_TYPE_U16 = 4,
  TOFGRAPH_TYPE_I16 = 5, TOFGRAPH_TYPE_I32 = 6
}; /* clang-format on */
/** Direction of a port. */
enum { TOFGRAPH_DIRECTION_IN = 1, TOFGRAPH_DIRECTION_OUT = 2, TOFGRAPH_DIRECTION_INOUT = 3 };
/** Level of a message. */
enum { TOFGRAPH_MESSAGE_INFO = 0, TOFGRAPH_MESSAGE_WARNING = 1 };

/** Flags of a port. OPTIONAL: an input that may be missing, an output that is there only when provided in prepare.
 * EVERY: stands for all channels of the stream (readers, writers, crop). */
enum { TOFGRAPH_PORT_OPTIONAL = 1, TOFGRAPH_PORT_EVERY = 2 };

/** Flags of a stage. STATELESS: process may run for several frames at once, in any order; otherwise one frame at a
 * time, in the order of the frames. MANY_INPUTS: a sink of any number of streams, with one frame of each. STEADY: after
 * its first frames process asks nobody but the host for memory; `plugin check` counts. */
enum { TOFGRAPH_STAGE_STATELESS = 1, TOFGRAPH_STAGE_MANY_INPUTS = 2, TOFGRAPH_STAGE_STEADY = 4 };

/** Kind of a parameter. NUMBER(S) have the unit of the parameter; paths come absolute. OUTPUT_FILE: one a run;
 * FRAME_FILES: one a frame, "out/cloud_{frame:06}.pcd"; IMAGE: values of the pixels, read by the host. */
enum { /* clang-format off */
  TOFGRAPH_KIND_BOOL = 1, TOFGRAPH_KIND_INTEGER = 2, TOFGRAPH_KIND_NUMBER = 3, TOFGRAPH_KIND_TEXT = 4,
  TOFGRAPH_KIND_CHOICE = 5, TOFGRAPH_KIND_NUMBERS = 6, TOFGRAPH_KIND_INPUT_FILE = 7, TOFGRAPH_KIND_OUTPUT_FILE = 8,
  TOFGRAPH_KIND_FRAME_FILES = 9, TOFGRAPH_KIND_INPUT_FOLDER = 10, TOFGRAPH_KIND_IMAGE = 11
}; /* clang-format on */
/** Flags of a parameter. LIVE: may change between frames, told by change(). IN_PLACE: of an INPUT_FILE, what it would
 * hold may be written instead of its path; the text is then YAML, "{..}", with absolute paths. NESTED: of an effect, a
 * refinement that a search varies only when the data demand it; shapes that follow it in the declaration go with it. */
enum { /* clang-format off */
  TOFGRAPH_PARAMETER_REQUIRED = 1, TOFGRAPH_PARAMETER_LIVE = 2, TOFGRAPH_PARAMETER_IN_PLACE = 4,
  TOFGRAPH_PARAMETER_NESTED = 8
}; /* clang-format on */

/** Lens of a camera. OPENCV: k1 k2 p1 p2 k3, rational and thin prism terms, skew. FISHEYE: `distortion` is k1 k2 k3 k4
 * of OpenCV's fisheye model (Kannala and Brandt), with the skew, and no more. RAYS: the table `rays` is all that is
 * known; focal length and principal point are those of the pinhole that fits it best. */
enum { TOFGRAPH_LENS_OPENCV = 0, TOFGRAPH_LENS_FISHEYE = 1, TOFGRAPH_LENS_RAYS = 2 };

/** Metadata bits: what is known of every frame of a stream. */
enum { /* clang-format off */
  TOFGRAPH_KNOWS_TIMESTAMP = 1, TOFGRAPH_KNOWS_INTEGRATION_TIME = 2, TOFGRAPH_KNOWS_MODULATION_FREQUENCY = 4,
  TOFGRAPH_KNOWS_TEMPERATURE = 8, TOFGRAPH_KNOWS_TIME_SINCE_POWER_ON = 16
}; /* clang-format on */

/** A plain view of one channel of one frame: the element at (i, j, ..) is at data + i stride[0] + j stride[1] + .. */
typedef struct tofgraph_view {
  uint32_t size, type; /* TOFGRAPH_TYPE_F32 .. */
  uint32_t rank, zero; /* 1 .. 4 */
  void* data;          /* read-only where it came from read() or a parameter */
  uint64_t extent[4];  /* slowest first; for an image rows, columns */
  int64_t stride[4];   /* bytes */
  const char *channel, *unit;
} tofgraph_view;

/** What a stream carries under one name, known before the first frame. Of the strings all but name may be null. */
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

/** One of the raw images that make a frame: A - B = amplitude cos(Psi + phase), Psi growing with the distance. A camera
 * that turns the other way has the phases' negatives, one with exchanged taps all of them half a turn on. */
typedef struct tofgraph_exposure {
  double phase;     /* rad, step of the demodulation against the light */
  double frequency; /* Hz; 0: the frame's modulation frequency */
} tofgraph_exposure;

/** A camera: its profile, and the ray of each pixel. */
typedef struct tofgraph_camera {
  uint32_t size, light_size, exposure_size, zero;
  const char* name;
  uint32_t width, height;        /* px */
  double focal_length, pitch[2]; /* m, pitch in x and y; NaN when only known in pixels */
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
  const tofgraph_exposure* exposures; /* of a frame, in their order */
  uint64_t exposure_count;            /* 0: four, 90 degrees apart */
  const char* model;            /* path of the file with the effects that belong to this very camera; may be null */
  double skew;                  /* of the axes: u = fx (x + skew y) + cx */
  double further_distortion[7]; /* k4 k5 k6 of the rational model, s1 s2 s3 s4 of a thin prism */
  uint32_t lens_model, zero2;   /* TOFGRAPH_LENS_.. */
} tofgraph_camera;

/** What arrives at a node, known before the first frame. It lives during prepare; its camera, with lights, rays and
 * profile, as long as the stage. */
typedef struct tofgraph_stream {
  uint32_t size, channel_size, exposure_size, zero;
  const char* node;              /* the node it comes from */
  const tofgraph_camera* camera; /* null: not known */
  const tofgraph_channel* channels;
  uint64_t channel_count;
  uint64_t frames, known;   /* how many will come, 0: unknown or endless; TOFGRAPH_KNOWS_.. */
  const char* const* bound; /* for each port of the stage the channel that it reads; null: not there */
  uint64_t bound_count;
  const tofgraph_exposure* exposures; /* that the raw images of these frames have, in their order */
  uint64_t exposure_count;
  const char* source; /* what is known of where the frames come from, as a JSON object */
} tofgraph_stream;

/** Metadata of one frame. */
typedef struct tofgraph_metadata {
  uint32_t size, zero;
  uint64_t number;                               /* place in the run, from 0; set by the host */
  uint64_t device_number;                        /* the device's own counter: gaps are lost frames */
  int64_t timestamp_ns;                          /* start of the exposure, since 1970 */
  double integration_time, modulation_frequency; /* s, Hz */
  double temperature, time_since_power_on;       /* K, s */
} tofgraph_metadata;

typedef struct tofgraph_frame tofgraph_frame; /* the host's */

/** Services of the host. `context` is what create() was given. All are there for every kind of plugin; what makes no
 * sense for one (an effect has no stream) fails the running call and says so. */
typedef struct tofgraph_host {
  uint32_t size, api_major, api_minor, zero;
  /** Says why the call is about to return TOFGRAPH_STATUS_ERROR; parameter: the one at fault, or null. */
  void (*fail)(void* context, const char* parameter, const char* text);
  void (*message)(void* context, uint32_t level, const char* text);
  /** Not 0 once the run is ending: a source that waits should return TOFGRAPH_STATUS_END. [any thread] */
  int (*stopping)(void* context);
  /** Not 0 when existing files may be replaced (--force, or overwrite: true at the node). output() sees to it. */
  int (*overwrite)(void* context);
  /** In prepare only: what the stage hands on, where that is more than its declared outputs. A channel of rank 0 is
   * that of the output port of its name. One that arrived is replaced. */
  void (*provide)(void* context, const tofgraph_channel* channel);
  void (*withdraw)(void* context, const char* channel);
  /** Copied. Rays null: made anew. Fields beyond its size stay those of the camera that arrives. */
  void (*set_camera)(void* context, const tofgraph_camera* camera);
  /** For sources: the camera by its profile's name, or by the profile's text where that is not null. ERROR: there
   * is no such profile; the stream keeps the camera it has. */
  int (*use_profile)(void* context, const char* name, const char* profile);
  void (*set_frames)(void* context, uint64_t frames, uint64_t known);
  /** For sources, in prepare: the exposures of the frames' raw images, where they are not the camera's. Copied. */
  void (*set_exposures)(void* context, const tofgraph_exposure* exposures, uint32_t exposure_size, uint64_t count);
  /** For sources, in prepare: what is known of where the frames come from, as a JSON object. Goes into the provenance.
   */
  void (*set_source)(void* context, const char* json);
  /** A file whose content shapes the result: its hash goes into the provenance. In prepare only. Images and input
   * files are seen to by the host. */
  void (*uses_file)(void* context, const char* path);
  /** The provenance of what arrives at this node, as JSON. Lives as long as the stage. Waits for the hashes of inputs:
   * best asked for in finish(), and in prepare(), where it is {}, so that they are made beside the run. */
  const char* (*provenance)(void* context);
  /** The folders in which the run finds plugins, in their order, with colons between; lives as long as the stage. */
  const char* (*plugin_path)(void* context);
  /** In process and finish: a new file under a temporary name, for what the parameter (OUTPUT_FILE, FRAME_FILES) names.
   * When the call returned OK the host gives it its final name, whole; otherwise it is removed. companion: null, or one
   * of the parameter's `choices`, for the file beside it. frame: its number, for FRAME_FILES. path: lives until the
   * call returns. */
  int (*output)(void* context, const char* parameter, const char* companion, uint64_t frame, const char** path);
  /** The channels of a frame. read: shared, do not write. write: memory for the channel, content undefined; where
   * nobody else holds what is there, that very memory. modify: a private copy where the buffer is shared. All return
   * OK, or ERROR when there is none. A view is filled in as far as its `size` reaches, and lives until the call
   * returns. share: memory of the plugin without gaps, which nobody writes; release(owner), which may be null, is
   * called once when nobody holds it any more, on any thread, also after destroy(), not when share() returned ERROR. */
  int (*read)(tofgraph_frame* frame, const char* channel, tofgraph_view* view);
  int (*write)(tofgraph_frame* frame, const tofgraph_channel* channel, tofgraph_view* view);
  int (*modify)(tofgraph_frame* frame, const char* channel, tofgraph_view* view);
  int (*share)(tofgraph_frame* frame, const tofgraph_view* view, void* owner, void (*release)(void* owner));
  int (*drop)(tofgraph_frame* frame, const char* channel);
  int (*rename)(tofgraph_frame* frame, const char* channel, const char* name);
  tofgraph_metadata* (*metadata)(tofgraph_frame* frame);
  /** Since 2.1. The run as a JSON object: nodes with what they read, times, parameters; frames; changes so far. `take`
   * is called once, before the call returns. ERROR: nothing runs. [any thread] */
  int (*run_state)(void* context, void (*take)(void* user, const char* json), void* user);
  /** Since 2.1. Gives a LIVE parameter of a node another value, written as in a pipeline. Waits until no frame is under
   * way, at most 2 s; if the source delivers nothing meanwhile, the change comes with its next frame. `take` is called
   * once: OK with a JSON object, "frame" being the first number with the new value; ERROR with the reason in words.
   * [any thread, but not inside another call of the stage] */
  int (*change_parameter)(void* context, const char* node, const char* parameter, const char* value,
                          void (*take)(void* user, const char* text), void* user);
} tofgraph_host;

/** A port: what a stage reads or makes, with its meaning. Words are blank-separated. Of the strings name and channel
 * may not be null. */
typedef struct tofgraph_port {
  const char *name, *channel; /* channel: an id, or alternatives "depth|range|distance": the first that is there, or the
                                 one named by a parameter called `channel`; "*" with the flag EVERY */
  const char *shape, *unit;   /* "H W", "P H W", "H W 3", ..: numbers, H and W of the image, P exposures, N; "" any */
  uint32_t type, direction, flags, zero;
  const char *needs,
      *refuses; /* stages or classes of corrections one of which must have been applied; none of which may */
  const char *from, *adds, *of; /* outputs: channels it is computed from; classes of corrections that it counts as
                                   ("non_linearity denoised offset"); for sigma the channel it belongs to */
  const char* text;
} tofgraph_port;

/** Of the strings name may not be null; fallback null: no default. */
typedef struct tofgraph_parameter {
  const char* name;
  uint32_t kind, flags;
  const char *unit, *default_value; /* SI, "" for a pure number, "m|counts|1" for any of these; the default, written as
                                  in a pipeline: "3.91 mm" */
  double minimum, maximum;          /* SI; NaN: no bound */
  const char *choices, *text; /* CHOICE: the words; NUMBER: words allowed beside numbers; files to write: endings of
                                 companions; INPUT_FILE: kinds of calibrations that a camera's folder gives for it;
                                 IMAGE: "mask" where only 0 or not 0 counts, pictures may then have 8 bits */
  double off, typical;        /* effects: the value that changes nothing, and a usual size; NaN: none */
} tofgraph_parameter;

/** The value of a parameter; they come in the order of the declaration, each `size` bytes after the one before. */
typedef struct tofgraph_value {
  uint32_t size, given;  /* given: not 0 when the user wrote it */
  int64_t integer;       /* BOOL, INTEGER */
  double number;         /* NUMBER, SI; NaN when a word was given */
  const char* text;      /* TEXT, CHOICE, paths, the word of a NUMBER, or its unit of several; else "" */
  const double* numbers; /* NUMBERS, so many: */
  uint64_t count;
  const tofgraph_view* image; /* IMAGE: float64, rows x columns, in SI; the camera's size in prepare; null: none */
} tofgraph_value;

/** A named struct beyond the plain stage; data begins with its own size. */
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
  const tofgraph_port* ports; /* null where there are none, as the two below */
  uint64_t port_count;
  const tofgraph_parameter* parameters;
  uint64_t parameter_count;
  const tofgraph_extension* extensions;
  uint64_t extension_count;
  /** Makes a stage; the calls are null in formats. The values live only during the call; host, context and the memory
   * of images as long as the stage. */
  int (*create)(const tofgraph_host* host, void* context, const tofgraph_value* values, void** self);
  /** Checks what arrives and says what leaves. Opens inputs, writes nothing. Sources get one stream without
   * channels, whose camera is the pipeline's or null; so do effects, with the scene's. */
  int (*prepare)(void* self, const tofgraph_stream* const* streams, uint64_t count);
  /** One frame: sources fill it, filters change it, sinks store it. [STATELESS: several threads] Null in effects. */
  int (*process)(void* self, tofgraph_frame* const* frames, uint64_t count);
  /** After the last frame, if nothing failed in this stage, also when the run was interrupted: complete the outputs.
   * May be null. */
  int (*finish)(void* self);
  /** Wakes a source that waits. May be null. [any thread] */
  void (*stop)(void* self);
  void (*destroy)(void* self);
  /** All values anew, as in create, of which LIVE ones may differ; between two frames, while no other call of this
   * stage runs. ERROR: the old ones stay. Null where no parameter is LIVE. */
  int (*change)(void* self, const tofgraph_value* values);
} tofgraph_descriptor;

/** The one symbol that a plugin exports. Never fails; the descriptor lives as long as the library. */
typedef const tofgraph_descriptor* (*tofgraph_plugin_function)(void);
#define TOFGRAPH_PLUGIN_SYMBOL "tofgraph_plugin"

#ifdef __cplusplus
}
#endif
#endif
