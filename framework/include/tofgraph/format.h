/* SPDX-FileCopyrightText: 2026 The tofgraph authors
 * SPDX-License-Identifier: BSD-3-Clause */
/** @file
 * Extension "format", version 1, of the plugin border: a file format of other programs, as a list of arrays. The rules
 * are those of `tofgraph/plugin.h`. C++ authors include `tofgraph/format.hpp` instead. */
#ifndef TOFGRAPH_FORMAT_H
#define TOFGRAPH_FORMAT_H

#include <tofgraph/plugin.h>

#ifdef __cplusplus
extern "C" {
#endif

/** Kinds of elements. */
enum { TOFGRAPH_ELEMENT_SIGNED = 1, TOFGRAPH_ELEMENT_UNSIGNED = 2, TOFGRAPH_ELEMENT_FLOAT = 3 };

/** Flags of an array. REVERSED: people who use the format count the axes the other way round (Fortran order). */
enum { TOFGRAPH_ARRAY_REVERSED = 1 };

/** An array of a file. Elements are in the byte order of this machine when they are read. */
typedef struct tofgraph_file_array {
  uint32_t size, flags;
  uint32_t kind, bytes; /* TOFGRAPH_ELEMENT_..; of an element: 1, 2, 4, 8; a float has 4 or 8 */
  uint32_t rank, zero;  /* 1 to 6 */
  uint64_t extent[6];   /* in memory, the slowest axis first */
  const char* name;     /* in the file; "" where it has one only */
  const char* unit;     /* as the file states it; "": not stated */
  const char* text;     /* for people, e.g. "sensor_msgs/Image, 16UC1" */
  const char* axes;     /* meaning of the axes where the format defines it, e.g. "row column"; "": it does not */
} tofgraph_file_array;

/** What open() reports to. Valid during the call. */
typedef struct tofgraph_format_host {
  uint32_t size, zero;
  void* context;
  void (*fail)(void* context, const char* text); /* why open() or read() is about to fail, without the file's name */
  void (*add)(void* context, const tofgraph_file_array* array);
  void (*profile)(void* context, const char* text); /* a camera profile (YAML) that follows from the file */
} tofgraph_format_host;

/** Data of the extension. */
typedef struct tofgraph_format {
  uint32_t size, zero;
  const char* endings; /* usual endings of names, blank-separated; the content decides */
  /** Not 0: a file that begins like this, up to 4096 bytes, is of this format. */
  int (*recognises)(const uint8_t* head, uint64_t bytes);
  /** @returns the opened file, or null after host->fail. Nothing is allocated by sizes that the file does not hold. */
  void* (*open)(const char* path, const tofgraph_format_host* host);
  /** Elements first .. first + count - 1 of the slowest axis. One thread at a time. */
  int (*read)(void* file, uint64_t array, uint64_t first, uint64_t count, void* out, const tofgraph_format_host* host);
  void (*close)(void* file);
} tofgraph_format;

#ifdef __cplusplus
}
#endif
#endif
