// Tracker, retarget and encoding of one frame together, for those who compare with it.
#pragma once

namespace volto::bench {

void setPipelineCostUs(double us);
double pipelineCostUs();  // 0: not measured in this run

}  // namespace volto::bench
