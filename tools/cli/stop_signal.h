// SIGTERM and SIGINT ask a running verb to finish cleanly.
#pragma once

namespace volto::cli {

// Call once, before other threads start. A second signal of the same kind ends the process at once. Also ignores
// SIGPIPE, so that a reader that goes away is an error that can be told.
void installStopSignals();

// True once SIGTERM or SIGINT has come. Reentrant, costs one atomic load: ask it every frame. A blocking system call
// returns EINTR.
bool stopRequested();

// SIGUSR1 asks a running verb to calibrate anew. Without this call it ends the process.
void installCalibrateSignal();
// True once per signal.
bool calibrateRequested();

}  // namespace volto::cli
