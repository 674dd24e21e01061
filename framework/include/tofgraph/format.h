/* SPDX-FileCopyrightText: 2026 The tofgraph authors
 * SPDX-License-Identifier: BSD-3-Clause */
/** @file
 * Extension "format", version 1, of the plugin interface: another program's file format as a list of arrays. The rules
 * are those of `tofgraph/plugin.h`. C++ authors include `tofgraph/format.hpp` instead. */
#ifndef TOFGRAPH_FORMAT_H
#define TOFGRAPH_FORMAT_H

#include <tofgraph/plugin.h>

#ifdef __cplusplus
extern "C" {
#endif

/** Kinds of elements. */
enum { TOFGRAPH_ELEMENT_SIGNED = 1, TOFGRAPH_ELEMENT_UNSIGNED = 2, TOFGRAPH_ELEMENT_FLOAT = 3 };

/** Flags of an array. REVERSED: users of the format count the axes in reverse order (Fortran order). */
enum { TOFGRAPH_ARRAY_REVERSED = 1 };

/** Array of a file. Elements are read in the byte order of this machine. */
typedef struct tofgraph_file_array {
  uint32_t size, flags;
  uint32_t kind, bytes; /* TOFGRAPH_ELEMENT_..; size of an element: 1, 2, 4, 8; of a float 4 or 8 */
  uint32_t rank, zero;  /* 1 to 6 */
  uint64_t extent[6];   /* in memory, slowest axis first */
  const char* name;     /* in the file; "" if the file has only one array */
  const char* unit;     /* as stated in the file; "": not stated */
  const char* text;     /* readable description, e.g. "sensor_msgs/Image, 16UC1" */
  const char* axes;     /* meaning of the axes if the format defines it, e.g. "row column"; else "" */
} tofgraph_file_array;

/** Receives the results of open(). Valid during the call. */
typedef struct tofgraph_format_host {
  uint32_t size, zero;
  void* context;
  void (*fail)(void* context, const char* text); /* reason why open() or read() fails, without the file name */
  void (*add)(void* context, const tofgraph_file_array* array);
  void (*profile)(void* context, const char* text); /* camera profile (YAML) derived from the file */
} tofgraph_format_host;

/** Data of the extension. */
typedef struct tofgraph_format {
  uint32_t size, zero;
  const char* endings; /* usual file name extensions, blank-separated; the content decides */
  /** Returns non-zero if a file with these first bytes, 4096 at most, is of this format. */
  int (*recognises)(const uint8_t* head, uint64_t bytes);
  /** @returns the opened file, or null after host->fail. Must not allocate by sizes that exceed the file's content. */
  void* (*open)(const char* path, const tofgraph_format_host* host);
  /** Reads elements first .. first + count - 1 of the slowest axis. One thread at a time. */
  int (*read)(void* file, uint64_t array, uint64_t first, uint64_t count, void* out, const tofgraph_format_host* host);
  void (*close)(void* file);
} tofgraph_format;

#ifdef __cplusplus
}
#endif
#endif
