#include "tools/cli/first_subscriber.h"

#include "tools/cli/stop_signal.h"

namespace volto::cli {

void waitForFirstSubscriber(protocol::Publisher& publisher, double seconds) {
  constexpr int kStep_ms = 100;
  for (int waited_ms = 0; waited_ms < static_cast<int>(seconds * 1000) && !stopRequested(); waited_ms += kStep_ms)
    if (publisher.waitForSubscriber(protocol::MessageKind::weights, kStep_ms)) break;
}

}  // namespace volto::cli
