// The suppressions of tests/support/tsan.supp, so that the tests run clean however they are started.
#if defined(__SANITIZE_THREAD__)
#include <cstdlib>

extern "C" const char* __tsan_default_suppressions() {
  return "called_from_lib:libzmq.so\nrace:libzmq.so\nrace:libsodium.so\n";
}

// The programs that the tests start have no such function.
[[maybe_unused]] static const int handed_on = setenv("TSAN_OPTIONS", "suppressions=" VOLTO_TSAN_SUPPRESSIONS, 0);
#endif
