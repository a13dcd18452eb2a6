# cmake -D SOURCE=… -D BUILD=… -P images.cmake: builds the images for the STM32F405 in BUILD, where there is a compiler
# for them, as they are shipped.
unset(ENV{MAKEFLAGS}) # of the build that this is part of: its job server is not for this one
find_program(gcc arm-none-eabi-gcc)
if(NOT gcc)
    message(STATUS "No arm-none-eabi-gcc: tests of the images for the STM32F405 are skipped")
    return()
endif()
execute_process(COMMAND "${CMAKE_COMMAND}" --preset stm32f4 -B "${BUILD}" --log-level=NOTICE
    WORKING_DIRECTORY "${SOURCE}" COMMAND_ERROR_IS_FATAL ANY OUTPUT_QUIET)
execute_process(COMMAND "${CMAKE_COMMAND}" --build "${BUILD}" --parallel 2
    COMMAND_ERROR_IS_FATAL ANY OUTPUT_VARIABLE output)
string(REGEX MATCHALL "-- lever_stm32f4[^\n]*\n" sizes "${output}")
foreach(size IN LISTS sizes)
    string(STRIP "${size}" size)
    message("${size}")
endforeach()
