// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <memory>
#include <string>

#include "core/result.hpp"

namespace orbitfuse::view {

/// Who may render now. One render uses all cores, so that only one runs at a time; it is cut into
/// pieces, and before each the client that has had least so far comes first. A client's newer job
/// ends its older one.
class RenderTurns {
 public:
  RenderTurns();
  ~RenderTurns();
  RenderTurns(const RenderTurns&) = delete;
  RenderTurns& operator=(const RenderTurns&) = delete;

  /// Held while a piece is rendered.
  class Turn {
   public:
    explicit Turn(RenderTurns* turns) : turns_(turns) {}
    Turn(Turn&& other) noexcept : turns_(other.turns_) { other.turns_ = nullptr; }
    Turn& operator=(Turn&&) = delete;
    ~Turn();

   private:
    RenderTurns* turns_;
  };

  /// One client's wish for one picture, in pieces.
  class Job {
   public:
    Job(RenderTurns& turns, std::string client, const std::atomic<bool>* gone);
    ~Job();
    Job(const Job&) = delete;
    Job& operator=(const Job&) = delete;

    /// Waits until it is this job's turn; `cost` in any unit, the same for all. Errors: cancelled
    /// (a newer job of the client, nobody waits any more, the viewer closes), unavailable (too many
    /// wait).
    Result<Turn> turn(double cost);
    bool over() const;

   private:
    friend class RenderTurns;
    RenderTurns& turns_;
    std::string client_;
    const std::atomic<bool>* gone_;
    std::atomic<bool> superseded_{false};
  };

  /// How many jobs wait for their turn.
  std::size_t waiting() const;
  /// A piece is being rendered, or waited for.
  bool busy() const;
  /// Ends all jobs, and those that come later at once.
  void close();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace orbitfuse::view
