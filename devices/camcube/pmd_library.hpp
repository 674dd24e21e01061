// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The vendor's library, found and opened while the program runs; nothing links it.
#pragma once

#include <string>
#include <vector>

#include "devices/camcube/errors.hpp"
#include "devices/camcube/pmd_api.hpp"

namespace tofgraph::camcube {

/// Never closed again: a call into it may still be running when the camera is given up.
class PmdLibrary {
 public:
  /// Search path of the library: only `library` if that is given; else below $PMDDIR, /usr/local/pmd, and in the
  /// system's folders.
  static std::vector<std::string> candidates(const std::string& library);
  /// @param library path, may be empty
  /// @throws NotFound naming all places, and of each why it does not serve
  explicit PmdLibrary(const std::string& library);

  const std::string& path() const { return path_; }
  /// A plugin's file below the SDK's folder `plugins`, where there is one; else the name as it is.
  std::string plugin(const std::string& name) const;
  /// The plugins there, for a message.
  std::string plugins() const;

  /// A function that older versions do not have, or null.
  template <class Function> Function* find(const char* name) const { return reinterpret_cast<Function*>(symbol(name)); }
  /// @param parameter what needs it @throws SettingError naming the function
  template <class Function> Function& need(const char* name, const char* parameter) const {
    if (Function* function = find<Function>(name); function != nullptr) return *function;
    throw SettingError(parameter, path_ + " has no function " + name + ": is it an older version?");
  }

  /// Text of the library's last error, with the code. @param handle 0: of opening
  std::string error_text(pmd::Handle handle, int result) const;

 private:
  void* symbol(const char* name) const;

  std::string path_;
  void* library_ = nullptr;
};

}  // namespace tofgraph::camcube
