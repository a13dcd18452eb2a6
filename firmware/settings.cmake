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
