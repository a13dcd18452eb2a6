# Settings of a build: from a settings file (`lever tune`, `lever settings`) to the header lever_build.h, which ports
# include. Names, ranges and choices are those of lever_settings.def and lever_cdkf.h; a line that is wrong ends the
# configuration. Needs nothing but CMake, as a machine that cross-compiles may have no Python.

set(lever_number_pattern "^[-+]?([0-9]+\\.?[0-9]*|\\.[0-9]+)([eE][-+]?[0-9]+)?$")

# lever_build_choice(PLACE NAME VALUE OUT): the C statement that makes a choice by name.
function(lever_build_choice place name value out)
    file(READ "${CMAKE_CURRENT_FUNCTION_LIST_DIR}/lever_cdkf.h" header)
    string(TOUPPER "LEVER_${name}_${value}" enumerator)
    string(FIND "${header}" " ${enumerator} = " found)
    if(found EQUAL -1)
        message(FATAL_ERROR "${place}: ${name} = ${value} is not known; `lever settings` lists what is")
    endif()
    set(${out} "config->${name} = (uint8_t)${enumerator};" PARENT_SCOPE)
endfunction()

# lever_build_setting(PLACE NAME VALUE OUT): the C statement that sets a setting, as a number of type float.
function(lever_build_setting place name value out)
    file(READ "${CMAKE_CURRENT_FUNCTION_LIST_DIR}/lever_settings.def" table)
    if(NOT table MATCHES "\nLEVER_SETTING\\(${name}, \"([^\"]*)\", [^,]+, ([^,]+)f, ([^,]+)f, ")
        message(FATAL_ERROR "${place}: unknown setting ${name}; `lever settings` lists them all")
    endif()
    set(unit "${CMAKE_MATCH_1}")
    set(least "${CMAKE_MATCH_2}")
    set(greatest "${CMAKE_MATCH_3}")
    if(NOT value MATCHES "${lever_number_pattern}")
        message(FATAL_ERROR "${place}: ${name} = ${value} is not a number (give it in ${unit}, without the unit)")
    endif()
    if(value LESS least OR value GREATER greatest)
        message(FATAL_ERROR "${place}: ${name} = ${value} is out of range: from ${least} to ${greatest} ${unit}")
    endif()
    if(NOT value MATCHES "[.eE]")
        string(APPEND value ".0")
    endif()
    set(${out} "config->settings.${name} = ${value}f;" PARENT_SCOPE)
endfunction()

# lever_build_assignments(FILE OUT): the C statements for all lines of a settings file.
function(lever_build_assignments settings_file out)
    file(READ "${settings_file}" text)
    string(REGEX REPLACE "#[^\n]*" "" text "${text}") # first, as comments may hold what a CMake list cannot
    if(text MATCHES "[][;]")
        message(FATAL_ERROR "${settings_file}: is not a settings file: write name = value")
    endif()
    string(REGEX REPLACE "[ \t\r]" "" text "${text}")
    string(REPLACE "\n" ";" lines "${text}")
    set(statements "")
    set(place 0)
    foreach(line IN LISTS lines)
        math(EXPR place "${place} + 1")
        if(line STREQUAL "")
            continue()
        elseif(NOT line MATCHES "^([a-z0-9_]+)=([^=]+)$")
            message(FATAL_ERROR "${settings_file}:${place}: ${line} is not understood: write name = value")
        endif()
        set(name "${CMAKE_MATCH_1}")
        set(value "${CMAKE_MATCH_2}")
        if(name MATCHES "^(model|preload|estimator|adaptation)$")
            lever_build_choice("${settings_file}:${place}" "${name}" "${value}" statement)
        else()
            lever_build_setting("${settings_file}:${place}" "${name}" "${value}" statement)
        endif()
        string(APPEND statements "    ${statement}\n")
    endforeach()
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
