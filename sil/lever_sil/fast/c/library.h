/* All that the shared library lever_loop has. */
#ifndef LIBRARY_H
#define LIBRARY_H

#include "filters.h"
#include "lanes.h"
#include "loop.h"

#endif
