// A rigged character as the wire tells renderers of it.
#pragma once

#include "protocol/messages.h"
#include "rig/rig.h"

namespace volto::pipeline {

// `with_mesh` false: names and eyes only, for a publisher that sends weights alone.
protocol::Character characterOf(const rig::Rig& rig, bool with_mesh = true);

}  // namespace volto::pipeline
