// Read by the leak sanitizer when it is linked in. OSMesa keeps the record of its default frame buffer, about
// 100 bytes, when a context is destroyed.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libOSMesa.so\n"; }
