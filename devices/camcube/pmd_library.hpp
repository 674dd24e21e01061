// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The vendor's library, searched for and opened at run time; nothing links to it.
#pragma once

#include <string>
#include <vector>

#include "devices/camcube/errors.hpp"
#include "devices/camcube/pmd_api.hpp"

namespace tofgraph::camcube {

/// Never closed: a call into it may still be running when the camera is abandoned.
class PmdLibrary {
 public:
  /// Search path of the library: only `library` if given; else below $PMDDIR, /usr/local/pmd, and in the system's
  /// folders.
  static std::vector<std::string> candidates(const std::string& library);
  /// @param library path, may be empty
  /// @throws NotFound naming all places searched, with the reason why each was rejected
  explicit PmdLibrary(const std::string& library);

  const std::string& path() const { return path_; }
  /// File of a plugin in the SDK's folder `plugins` if it exists there; else the name unchanged.
  std::string plugin(const std::string& name) const;
  /// Plugins in that folder, for a message.
  std::string plugins() const;

  /// Returns a function that older versions lack, or null.
  template <class Function> Function* find(const char* name) const { return reinterpret_cast<Function*>(symbol(name)); }
  /// @param parameter that needs the function @throws SettingError naming the function
  template <class Function> Function& need(const char* name, const char* parameter) const {
    if (Function* function = find<Function>(name); function != nullptr) return *function;
    throw SettingError(parameter, path_ + " has no function " + name + ": is it an older version?");
  }

  /// Text of the library's last error, with the code. @param handle 0: error of opening
  std::string error_text(pmd::Handle handle, int result) const;

 private:
  void* symbol(const char* name) const;

  std::string path_;
  void* library_ = nullptr;
};

}  // namespace tofgraph::camcube
