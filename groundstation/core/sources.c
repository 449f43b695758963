/* Which sources this library was made of: the loader refuses a library of other sources. */
#include "core.h"

#ifndef GS_SOURCES
#error "GS_SOURCES is set by the build: the hash of all sources and flags"
#endif

const char *gs_sources(void) { return GS_SOURCES; }
