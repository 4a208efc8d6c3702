# find_package(servowire): the target servowire::servowire, of lib/<Rust target>/libservowire_c.a and include/servowire.h.
# A cross build names the target: -DSERVOWIRE_TARGET=thumbv7em-none-eabihf.
get_filename_component(_servowire "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
if(NOT SERVOWIRE_TARGET)
    if(CMAKE_CROSSCOMPILING OR NOT CMAKE_SYSTEM_NAME STREQUAL "Linux")
        message(FATAL_ERROR "servowire: set SERVOWIRE_TARGET to one of the folders in ${_servowire}/lib")
    endif()
    set(SERVOWIRE_TARGET "${CMAKE_SYSTEM_PROCESSOR}-unknown-linux-gnu")
endif()
set(_library "${_servowire}/lib/${SERVOWIRE_TARGET}/libservowire_c.a")
if(NOT EXISTS "${_library}")
    message(FATAL_ERROR "servowire: there is no ${_library}")
endif()
if(NOT TARGET servowire::servowire)
    add_library(servowire::servowire STATIC IMPORTED)
    set_target_properties(servowire::servowire PROPERTIES
        IMPORTED_LOCATION "${_library}"
        INTERFACE_INCLUDE_DIRECTORIES "${_servowire}/include"
        INTERFACE_LINK_OPTIONS "LINKER:--gc-sections")
endif()
