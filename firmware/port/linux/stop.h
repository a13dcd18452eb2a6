/* The request to end: SIGINT and SIGTERM as a descriptor to poll, so that none is missed and nothing is interrupted. */
#ifndef LEVER_PORT_STOP_H
#define LEVER_PORT_STOP_H

/* From now on SIGINT and SIGTERM no longer end the process but make the returned descriptor readable, and it stays so.
 * Nor does SIGPIPE: that nobody reads our messages any more is no reason to stop estimating.
 * Returns -1, with errno set, if that fails. Call it once, before any thread starts. */
int stop_descriptor(void);

#endif
