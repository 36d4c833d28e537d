/* What an FMU's library needs on Windows besides Windows' own C library: its entry, and what the headers of MinGW-w64 call by other names.

   The library of MinGW-w64 has all this and hundreds of things more, and takes minutes of processor time to compile. */

#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

int _fltused = 1; /* the compiler names it where there are floating-point numbers */

/* Nothing is to be done when the library is loaded: there are neither constructors nor values of threads. */
int __stdcall DllMainCRTStartup(void *library, unsigned long reason, void *reserved) { return 1; }

int __isnan(double x) { return __builtin_isnan(x); }
int __signbit(double x) { return __builtin_signbit(x); }
int __fpclassify(double x) { return __builtin_fpclassify(FP_NAN, FP_INFINITE, FP_NORMAL, FP_SUBNORMAL, FP_ZERO, x); }

/* of the library beside the C library, which not every Windows has */
char *strchr(const char *text, int sought) {
    for (; *text != (char)sought; text++)
        if (!*text) return NULL;
    return (char *)text;
}

/* C99: the length that the whole text has, and an end at any size. */
int vsnprintf(char *text, size_t size, const char *format, va_list arguments) {
    const unsigned long long standard = 2; /* _CRT_INTERNAL_PRINTF_STANDARD_SNPRINTF_BEHAVIOR */
    return __stdio_common_vsprintf(standard, text, size, format, NULL, arguments);
}

int snprintf(char *text, size_t size, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    const int length = vsnprintf(text, size, format, arguments);
    va_end(arguments);
    return length;
}
