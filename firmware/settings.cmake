# Settings of a build: from a settings file (`lever tune`, `lever settings`) to the header lever_build.h, which ports
# include. Names, ranges and choices are those of lever_settings.def and lever_cdkf.h, the grammar that of
# port/linux/settings.h; a line that is wrong ends the configuration. Needs nothing but CMake, as a machine that
# cross-compiles may have no Python.

set(lever_number_pattern "^[-+]?([0-9]+\\.?[0-9]*|\\.[0-9]+)([eE][-+]?[0-9]+)?$")

# lever_build_choice(PLACE NAME VALUE OUT): the C statement that makes a choice by name.
function(lever_build_choice place name value out)
    file(READ "${CMAKE_CURRENT_FUNCTION_LIST_DIR}/lever_cdkf.h" header)
    string(TOUPPER "LEVER_${name}_${value}" enumerator)
    string(FIND "${header}" " ${enumerator} = " found)
    if(found EQUAL -1 OR value MATCHES "[A-Z]")
        message(FATAL_ERROR "${place}: ${name} = ${value} is not known; `lever settings` lists what is")
    endif()
    set(${out} "config->${name} = (uint8_t)${enumerator};" PARENT_SCOPE)
endfunction()

# lever_build_setting(PLACE NAME VALUE UNIT OUT): the C statement that sets a setting, as a number of type float.
function(lever_build_setting place name value written_unit out)
    file(READ "${CMAKE_CURRENT_FUNCTION_LIST_DIR}/lever_settings.def" table)
    if(NOT table MATCHES "\nLEVER_SETTING\\(${name}, \"([^\"]*)\", [^,]+, ([^,]+)f, ([^,]+)f, ")
        message(FATAL_ERROR "${place}: unknown setting ${name}; `lever settings` lists them all")
    endif()
    set(unit "${CMAKE_MATCH_1}")
    set(least "${CMAKE_MATCH_2}")
    set(greatest "${CMAKE_MATCH_3}")
    if(NOT value MATCHES "${lever_number_pattern}")
        message(FATAL_ERROR "${place}: ${name} = ${value} is not a number (give it in ${unit})")
    endif()
    if(NOT written_unit STREQUAL "" AND NOT written_unit STREQUAL unit)
        message(FATAL_ERROR "${place}: ${name} = ${value} ${written_unit}: a build takes it in ${unit}; "
            "`lever settings --settings FILE` converts")
    endif()
    if(value LESS least OR value GREATER greatest)
        message(FATAL_ERROR "${place}: ${name} = ${value} is out of range: from ${least} to ${greatest} ${unit}")
    endif()
    if(NOT value MATCHES "[.eE]")
        string(APPEND value ".0")
    endif()
    set(${out} "config->settings.${name} = (float)${value};" PARENT_SCOPE)
endfunction()

# lever_build_lines(FILE OUT): the text of a settings file without a byte order mark, every line with its end.
function(lever_build_lines settings_file out)
    file(READ "${settings_file}" hex HEX)
    string(REGEX REPLACE "(..)" "\\1 " hex "${hex}")
    if(hex MATCHES "00 ")
        message(FATAL_ERROR "${settings_file}: is not text")
    endif()
    file(READ "${settings_file}" text) # takes the CR from the end of a line
    string(ASCII 239 187 191 bom)
    if(text MATCHES "^${bom}(.*)$")
        set(text "${CMAKE_MATCH_1}")
    endif()
    set(${out} "${text}\n" PARENT_SCOPE)
endfunction()

# lever_build_assignment(PLACE LINE OUT): the C statement for a line, or nothing.
function(lever_build_assignment place line out)
    set(statement "")
    string(LENGTH "${line}" length)
    if(length GREATER 510)
        message(FATAL_ERROR "${place}: the line is longer than 510 bytes")
    endif()
    string(REGEX REPLACE "#.*" "" line "${line}")
    if(line MATCHES "^[ \t]*([a-z0-9_]+)[ \t]*=[ \t]*([^ \t=]+)([^=]*)$")
        set(name "${CMAKE_MATCH_1}")
        set(value "${CMAKE_MATCH_2}")
        string(REGEX REPLACE "^[ \t]+|[ \t]+$" "" unit "${CMAKE_MATCH_3}")
        if(name MATCHES "^(model|preload|estimator|adaptation|mitigation)$")
            string(STRIP "${value} ${unit}" value)
            lever_build_choice("${place}" "${name}" "${value}" statement)
        else()
            lever_build_setting("${place}" "${name}" "${value}" "${unit}" statement)
        endif()
    elseif(NOT line MATCHES "^[ \t]*$")
        message(FATAL_ERROR "${place}: ${line} is not understood: write name = value")
    endif()
    set(${out} "${statement}" PARENT_SCOPE)
endfunction()

# lever_build_assignments(FILE OUT): the C statements for all lines of a settings file.
function(lever_build_assignments settings_file out)
    lever_build_lines("${settings_file}" text)
    set(statements "")
    set(number 0)
    while(NOT text STREQUAL "") # no list, as a line may hold what a CMake list cannot
        math(EXPR number "${number} + 1")
        string(FIND "${text}" "\n" end)
        string(SUBSTRING "${text}" 0 ${end} line)
        math(EXPR next "${end} + 1")
        string(SUBSTRING "${text}" ${next} -1 text)
        lever_build_assignment("${settings_file}:${number}" "${line}" statement)
        if(statement)
            string(APPEND statements "    ${statement}\n")
        endif()
    endwhile()
    set(${out} "${statements}" PARENT_SCOPE)
endfunction()

# lever_write_build_header(FILE HEADER): writes the header, and configures anew when the file changes. Without a file it
# holds the defaults.
function(lever_write_build_header settings_file header)
    set(statements "")
    set(origin "lever_settings.def alone")
    if(settings_file)
        get_filename_component(settings_file "${settings_file}" ABSOLUTE BASE_DIR "${CMAKE_SOURCE_DIR}")
        if(NOT EXISTS "${settings_file}" OR IS_DIRECTORY "${settings_file}")
            message(FATAL_ERROR "LEVER_SETTINGS_FILE: there is no file ${settings_file}")
        endif()
        set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${settings_file}")
        lever_build_assignments("${settings_file}" statements)
        set(origin "${settings_file}")
        message(STATUS "Settings of this build: ${settings_file}")
    endif()
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS
        "${CMAKE_CURRENT_FUNCTION_LIST_DIR}/lever_settings.def" "${CMAKE_CURRENT_FUNCTION_LIST_DIR}/lever_cdkf.h")
    file(CONFIGURE OUTPUT "${header}" @ONLY CONTENT [[
/* The configuration of this build, from @origin@. Written by firmware/settings.cmake: do not edit. */
#ifndef LEVER_BUILD_H
#define LEVER_BUILD_H

#include "lever_cdkf.h"

/* The defaults, and what LEVER_SETTINGS_FILE says; lever_config_check() finds nothing wrong with it. */
static inline void lever_build_config(lever_config_t *config)
{
    lever_config_default(config);
@statements@}

#endif
]])
endfunction()

# lever_check_build(SETTINGS_FILE AIRCRAFT_FILE HEADERS SOURCES): has lever_config_check() look at the configuration in
# lever_build.h, on this machine, and writes lever_build_port.h. With neither file there is nothing to check.
function(lever_check_build settings_file aircraft_file headers sources)
    set(aircraft "return NULL;")
    if(settings_file OR aircraft_file)
        set(tool "${headers}/check")
        set(compiler "${CMAKE_C_COMPILER}")
        if(CMAKE_CROSSCOMPILING)
            find_program(LEVER_HOST_COMPILER NAMES cc gcc clang DOC "C compiler for this machine: it checks settings and aircraft")
            set(compiler "${LEVER_HOST_COMPILER}")
        endif()
        if(NOT compiler)
            message(FATAL_ERROR "Settings and aircraft of a build are checked on this machine, which has no C compiler: "
                "apt install gcc, or -D LEVER_HOST_COMPILER=PATH")
        endif()
        set(firmware "${CMAKE_CURRENT_FUNCTION_LIST_DIR}")
        set(programs "${firmware}/port/build/check.c" "${firmware}/port/linux/aircraft.c" "${firmware}/port/linux/settings.c")
        execute_process(COMMAND "${compiler}" -std=c99 -O0 -ffp-contract=off -I "${firmware}" -I "${headers}" ${programs} ${sources} -lm -o "${tool}"
            RESULT_VARIABLE status ERROR_VARIABLE error)
        if(NOT status EQUAL 0)
            message(FATAL_ERROR "${compiler} cannot compile the check of settings and aircraft:\n${error}")
        endif()
        set(from)
        if(aircraft_file)
            get_filename_component(from "${aircraft_file}" ABSOLUTE BASE_DIR "${CMAKE_SOURCE_DIR}")
            set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${from}")
        endif()
        set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${programs} ${sources})
        execute_process(COMMAND "${tool}" "LEVER_SETTINGS_FILE" ${from}
            RESULT_VARIABLE status OUTPUT_VARIABLE initialiser ERROR_VARIABLE error)
        if(NOT status EQUAL 0)
            message(FATAL_ERROR "${error}")
        endif()
        if(aircraft_file)
            message(STATUS "Aircraft of this build: ${from}")
            set(aircraft "static const lever_aircraft_t aircraft = {\n${initialiser}    };\n    return &aircraft;")
        endif()
    endif()
    file(CONFIGURE OUTPUT "${headers}/lever_build_port.h" @ONLY CONTENT [[
/* Aircraft and identifiers of this build, for its port. Written by firmware/settings.cmake: do not edit. */
#ifndef LEVER_BUILD_PORT_H
#define LEVER_BUILD_PORT_H

#include <stddef.h>

#include "lever_cdkf.h"

/* What LEVER_ID_OFFSET or LEVER_ID_BASE says, as port/identifiers.h has it. */
#define LEVER_IDENTIFIERS @LEVER_IDENTIFIERS@

/* What LEVER_AIRCRAFT_FILE says; NULL without one. */
static inline const lever_aircraft_t *lever_build_aircraft(void)
{
    @aircraft@
}

#endif
]])
endfunction()

# lever_check_identifiers(OFFSET BASE OUT): both as the word of port/identifiers.h.
function(lever_check_identifiers offset base out)
    if(NOT "${offset}" MATCHES "^(0x[0-9a-fA-F]+|[0-9]+)$")
        message(FATAL_ERROR "LEVER_ID_OFFSET is ${offset}: it must be a number, such as 0x40")
    endif()
    math(EXPR shift "${offset}" OUTPUT_FORMAT HEXADECIMAL)
    if(shift GREATER 1504) # IDENTIFIERS_OFFSET_MAX, which the compiler compares
        message(FATAL_ERROR "LEVER_ID_OFFSET is ${offset}: identifiers of 11 bits leave room for 0x5E0 at most")
    endif()
    if(NOT "${base}" STREQUAL "")
        if(NOT "${base}" MATCHES "^(0x[0-9a-fA-F]+|[0-9]+)$")
            message(FATAL_ERROR "LEVER_ID_BASE is ${base}: it must be a number, such as 0x18FF0000")
        endif()
        math(EXPR shift "${base}" OUTPUT_FORMAT HEXADECIMAL)
        if(NOT "${offset}" EQUAL 0 OR shift GREATER 536868864)
            message(FATAL_ERROR "LEVER_ID_BASE is ${base}: it goes without LEVER_ID_OFFSET, up to 0x1FFFF800")
        endif()
        math(EXPR shift "${shift} + 0x80000000" OUTPUT_FORMAT HEXADECIMAL)
    endif()
    set(${out} "${shift}u" PARENT_SCOPE)
endfunction()
