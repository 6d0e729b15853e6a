// SPDX-License-Identifier: BSD-3-Clause
#include "app/view/render_turns.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <list>
#include <map>
#include <mutex>

namespace orbitfuse::view {
namespace {

/// Who waits holds a thread of the server; beyond this many the page itself would wait.
constexpr std::size_t most_waiting = 16;
constexpr std::size_t most_clients = 256;  ///< whose share is remembered

}  // namespace

struct RenderTurns::Impl {
  std::mutex mutex;
  std::condition_variable changed;
  std::map<std::string, Job*> jobs;      ///< the newest of each client
  std::map<std::string, double> served;  ///< cost by client
  std::list<const Job*> waiting;         ///< in the order of arrival
  bool taken = false;
  std::atomic<bool> closed{false};

  /// Start-time fair queueing: `now` is what the client served last had had when its turn began.
  /// Who comes new, or again, starts there: neither behind all others nor with turns saved up.
  double now = 0;

  double& share_of(const std::string& client) {
    if (served.size() > most_clients) served.clear();
    double& share = served[client];
    share = std::max(share, now);
    return share;
  }

  const Job* next() {
    const Job* best = nullptr;
    double least = 0;
    for (const Job* job : waiting) {
      const double share = served[job->client_];
      if (best != nullptr && share >= least) continue;
      best = job;
      least = share;
    }
    return best;
  }
};

RenderTurns::RenderTurns() : impl_(std::make_unique<Impl>()) {}
RenderTurns::~RenderTurns() = default;

void RenderTurns::close() {
  impl_->closed = true;
  const std::lock_guard lock(impl_->mutex);
  impl_->changed.notify_all();
}

std::size_t RenderTurns::waiting() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->waiting.size();
}

bool RenderTurns::busy() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->taken || !impl_->waiting.empty();
}

RenderTurns::Turn::~Turn() {
  if (turns_ == nullptr) return;
  const std::lock_guard lock(turns_->impl_->mutex);
  turns_->impl_->taken = false;
  turns_->impl_->changed.notify_all();
}

RenderTurns::Job::Job(RenderTurns& turns, std::string client, const std::atomic<bool>* gone)
    : turns_(turns), client_(std::move(client)), gone_(gone) {
  const std::lock_guard lock(turns.impl_->mutex);
  Job*& newest = turns.impl_->jobs[client_];
  if (newest != nullptr) newest->superseded_ = true;
  newest = this;
  turns.impl_->changed.notify_all();
}

RenderTurns::Job::~Job() {
  const std::lock_guard lock(turns_.impl_->mutex);
  const auto newest = turns_.impl_->jobs.find(client_);
  if (newest != turns_.impl_->jobs.end() && newest->second == this)
    turns_.impl_->jobs.erase(newest);
}

bool RenderTurns::Job::over() const {
  return superseded_ || turns_.impl_->closed || (gone_ != nullptr && *gone_);
}

Result<RenderTurns::Turn> RenderTurns::Job::turn(double cost) {
  Impl& all = *turns_.impl_;
  std::unique_lock lock(all.mutex);
  if (all.waiting.size() >= most_waiting)
    return fail(ErrorKind::unavailable, "render", "too many viewers wait for pictures",
                "try again in a moment");
  all.waiting.push_back(this);
  all.share_of(client_);
  // `gone` turns true without a word: looked at now and then.
  while (!over() && (all.taken || all.next() != this))
    all.changed.wait_for(lock, std::chrono::milliseconds(50));
  all.waiting.remove(this);
  all.changed.notify_all();
  if (over())
    return fail(ErrorKind::cancelled, "render", "nobody waits for it any more", "ask again");
  all.taken = true;
  double& share = all.share_of(client_);
  all.now = share;
  share += cost;
  return Turn(&turns_);
}

}  // namespace orbitfuse::view
