// What can befall a scripted camera, as lines of its script: for tests and fuzzing that put them together at random.
#pragma once

#include <array>
#include <string_view>

namespace volto::fake {

inline constexpr auto kTroubles = std::to_array<std::string_view>({
    "unplug",
    "replug as video1",
    "replug as video4",
    "busy",
    "free",
    "open EACCES 2",
    "open ENXIO 1",
    "s_fmt EBUSY 2",
    "s_fmt adjust 320x180",
    "s_parm adjust 1/15",
    "reqbufs grant 1",
    "reqbufs ENOMEM 1",
    "querybuf offset bad",
    "mmap ENOMEM 2",
    "streamon ENOSPC 1",
    "streamon EIO 2",
    "dqbuf EIO 3",
    "dqbuf EIO forever",
    "dqbuf index 77 2",
    "qbuf EIO 1",
    "fatal",
    "bytesused 0 40",
    "bytesused short",
    "bytesused length+1 3",
    "flag_error p=0.5",
    "freeze 2500ms",
    "freeze streamoff",
    "freeze reopen",
    "drop p=0.9",
    "ts +3600s",
    "ts -1s",
    "ts 0",
    "ts realtime",
    "seq wrap",
    "seq stuck",
    "fps 3",
    "fps 90",
    "mjpg truncate",
    "mjpg bitflip",
    "mjpg garbage p=0.5",
    "mjpg progressive",
    "mjpg 65535x65535",
    "eintr every 3",
    "pollin spurious forever",
    "enum only ZZZZ",
    "querycap ENODEV 1",
    "ok",
    "chmod",
});

}  // namespace volto::fake
