/// Read by LeakSanitizer when it is linked. HDF5 1.10 loses an object header that it cannot decode, so damaged files "leak";
/// that our own handles are closed is tested in formats_rules_test.cpp.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libhdf5"; }
