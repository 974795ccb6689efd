// The wait for somebody who listens, before a performance begins.
#pragma once

#include "protocol/publisher.h"

namespace volto::cli {

// Returns when somebody listens for weights, after `seconds`, or when the program is asked to stop, whichever is first.
void waitForFirstSubscriber(protocol::Publisher& publisher, double seconds);

}  // namespace volto::cli
