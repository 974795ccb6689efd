#include "tools/cli/stop_signal.h"

#include <atomic>
#include <csignal>

namespace volto::cli {

namespace {

std::atomic<bool> stop_requested{false};
static_assert(std::atomic<bool>::is_always_lock_free, "the handler may touch nothing that can block");

std::atomic<bool> calibrate_requested{false};

void onCalibrate(int) { calibrate_requested.store(true, std::memory_order_relaxed); }

void onStop(int) { stop_requested.store(true, std::memory_order_relaxed); }

}  // namespace

void installStopSignals() {
  struct sigaction action {};
  action.sa_handler = onStop;
  sigemptyset(&action.sa_mask);
  action.sa_flags = static_cast<int>(SA_RESETHAND);  // no SA_RESTART: sleeps and waits must wake up
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGINT, &action, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
}

void installCalibrateSignal() {
  struct sigaction action {};
  action.sa_handler = onCalibrate;
  sigemptyset(&action.sa_mask);
  action.sa_flags = SA_RESTART;
  sigaction(SIGUSR1, &action, nullptr);
}

bool calibrateRequested() { return calibrate_requested.exchange(false, std::memory_order_relaxed); }

bool stopRequested() { return stop_requested.load(std::memory_order_relaxed); }

}  // namespace volto::cli
