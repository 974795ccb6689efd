// The suppressions of tests/support/tsan.supp, so that the tests run clean however they are started.
#if defined(__SANITIZE_THREAD__)
extern "C" const char* __tsan_default_suppressions() { return "called_from_lib:libzmq.so\n"; }
#endif
