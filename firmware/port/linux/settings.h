/* A configuration from text: from the command line, one `name = value` at a time, or from a file.
 *
 * Names are those of lever_settings.def, and the choices model, preload, estimator, adaptation and mitigation; the last
 * of two equal names counts. A number is in the unit of that table, or in the unit of lever_units.def that follows it.
 * The grammar of a settings file, for all who read one (lever_can, host_tools/lever_cdkf/firmware/settings_file.py,
 * firmware/settings.cmake), in bytes:
 *
 *     file       = [ EF BB BF ] line { LF line }
 *     line       = blank [ assignment blank ] [ "#" comment ] [ CR ]
 *     assignment = name blank "=" blank ( number [ blank unit ] | word )
 *     name, word = one or more of a-z 0-9 _
 *     number     = [ "+" | "-" ] ( digits [ "." [ digits ] ] | "." digits ) [ ( "e" | "E" ) [ "+" | "-" ] digits ]
 *     digits     = one or more of 0-9
 *     unit       = a spelling of lever_units.def for the unit of that name
 *     blank      = any number of spaces and tabs
 *     comment    = any bytes but NUL and LF
 *
 * A line has at most 510 bytes, not counting EF BB BF and CR. A number means the double nearest to it, rounded to
 * float; it is that which must be in range. (CMake cannot calculate: it compares the double before it is rounded, and
 * takes no unit but that of the table.)
 *
 *     preload = trim
 *     theta_noise = 2 mrad     # 0.002, 0.002 rad
 */
#ifndef LEVER_PORT_SETTINGS_H
#define LEVER_PORT_SETTINGS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

#include "lever_cdkf.h"

/* What is wrong, in one line without a full stop. */
typedef struct settings_error {
    char text[512];
} settings_error_t;

/* Sets one setting or choice. False, with `config` untouched and `error` filled in, when it is not known, not a number
 * or out of range. */
bool settings_set(lever_config_t *config, const char *name, const char *value, settings_error_t *error);

/* The same for a text "name = value", as in --set and in a line of a file. */
bool settings_assign(lever_config_t *config, const char *text, settings_error_t *error);

/* What takes a line of a file: without comment and blanks around it, never empty. False, with `error` filled in, if it
 * cannot. */
typedef bool (*settings_take_t)(void *context, const char *text, settings_error_t *error);

/* Gives the lines of a file to `take` until it refuses one, or the file is not of lines of the grammar; `path` is only
 * for the messages, which say path:line. */
bool settings_lines(FILE *file, const char *path, settings_take_t take, void *context, settings_error_t *error);

/* The end of the number of the grammar that a text begins with; the text itself if it does not. strtod() takes more. */
const char *settings_number_end(const char *text);

/* Reads a whole file, as settings_lines(). Stops at the first error, when `config` already has what came before. */
bool settings_read(lever_config_t *config, FILE *file, const char *path, settings_error_t *error);

/* The names that a choice ("model") can take, as "fixed, trim", in `text` of `size` bytes; false if it is no choice. */
bool settings_choice_names(const char *choice, char *text, size_t size);

/* One line for each choice and setting of `config`, in the form that settings_read() takes, with unit and meaning. */
void settings_write(const lever_config_t *config, FILE *file);

#endif
