// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace orbitfuse {

/// Why an operation failed; the program maps it to an exit code (app/terminal/exit_code.hpp).
enum class ErrorKind {
  usage,        ///< an option or configuration value is wrong
  input,        ///< a file or folder is missing, malformed or insufficient
  device,       ///< a camera or a disk failed
  quality,      ///< a stage ran but missed its quality gate
  unavailable,  ///< a feature or an outside program is not here
  cancelled,    ///< the user asked to stop
};

/// An expected failure: where it is, what was found there, what to do about it.
struct Error {
  ErrorKind kind = ErrorKind::input;
  std::string where;   ///< the file or field, e.g. "thermal/003.tiff" or "render.views"
  std::string found;   ///< e.g. "8-bit samples, 16 expected"
  std::string remedy;  ///< e.g. "import it as 8-bit thermal"

  /// "where: found; remedy" on one line.
  std::string message() const;
};

template <class T>
using Result = tl::expected<T, Error>;
using Status = Result<void>;

inline tl::unexpected<Error> fail(ErrorKind kind, std::string where, std::string found,
                                  std::string remedy) {
  return tl::unexpected<Error>(Error{kind, std::move(where), std::move(found), std::move(remedy)});
}

}  // namespace orbitfuse

#define ORBITFUSE_CONCAT_(a, b) a##b
#define ORBITFUSE_CONCAT(a, b) ORBITFUSE_CONCAT_(a, b)

/// Returns the error of a Status or Result from the enclosing function.
#define ORBITFUSE_TRY(expression)                                                          \
  do {                                                                                     \
    auto&& status_ = (expression);                                                         \
    if (!status_) return tl::unexpected(std::forward<decltype(status_)>(status_).error()); \
  } while (false)

/// ORBITFUSE_ASSIGN(auto x, make_x()): x on success, else returns the error. Several statements,
/// since x outlives them: not under an `if` or `for` without braces.
#define ORBITFUSE_ASSIGN(declaration, expression)                                  \
  auto ORBITFUSE_CONCAT(result_, __LINE__) = (expression);                         \
  if (!ORBITFUSE_CONCAT(result_, __LINE__))                                        \
    return tl::unexpected(std::move(ORBITFUSE_CONCAT(result_, __LINE__)).error()); \
  declaration = *std::move(ORBITFUSE_CONCAT(result_, __LINE__))
