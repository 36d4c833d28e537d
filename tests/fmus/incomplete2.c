/* The faulty FMU without one of FMI 2.0's functions. */

#define WITHOUT_STRING_STATUS
#include "faulty2.c"
