# cmake -D BUILD=… -D OUT=… -P build.cmake: what test_package.py looks at. In OUT: the core as BUILD installs it, and the project
# of this folder with that and with the sources; without optimisation, as the bits are the same. Where BUILD has an image
# for the STM32F405: the same core cross-compiled, and a project that finds it.

function(run)
    execute_process(COMMAND ${ARGN} COMMAND_ERROR_IS_FATAL ANY OUTPUT_QUIET)
endfunction()

# consumer(FOLDER OPTION...): the project of this folder, built in a folder of OUT
function(consumer folder)
    run("${CMAKE_COMMAND}" -S "${CMAKE_CURRENT_LIST_DIR}" -B "${OUT}/${folder}" -D CMAKE_BUILD_TYPE=Debug ${ARGN})
    run("${CMAKE_COMMAND}" --build "${OUT}/${folder}")
endfunction()

# install_core(BUILD FOLDER)
function(install_core build folder)
    file(REMOVE_RECURSE "${OUT}/${folder}")
    run("${CMAKE_COMMAND}" --install "${build}" --component core --prefix "${OUT}/${folder}")
endfunction()

install_core("${BUILD}" installed)
consumer(with_installed -D "lever_cdkf_ROOT=${OUT}/installed")
consumer(with_sources)
if(EXISTS "${BUILD}/stm32f4/lever_stm32f4_can.elf")
    install_core("${BUILD}/stm32f4" installed_stm32f4)
    consumer(stm32f4 -D "lever_cdkf_ROOT=${OUT}/installed_stm32f4" -D "CMAKE_FIND_ROOT_PATH=${OUT}/installed_stm32f4"
        -D "CMAKE_TOOLCHAIN_FILE=${CMAKE_CURRENT_LIST_DIR}/../../../firmware/port/stm32f4/toolchain.cmake"
        -D CMAKE_EXE_LINKER_FLAGS=--specs=nosys.specs)
endif()
