# find_package(volto): static libraries, so what they are made of is looked for too.
include(CMakeFindDependencyMacro)
find_dependency(Eigen3 3.4 NO_MODULE)
find_dependency(hwy 1.0)
find_dependency(nlohmann_json 3.11)
find_dependency(PkgConfig)
pkg_check_modules(volto_zmq REQUIRED IMPORTED_TARGET libzmq>=4.3.3)
pkg_check_modules(volto_sqlite REQUIRED IMPORTED_TARGET sqlite3>=3.37)
include("${CMAKE_CURRENT_LIST_DIR}/volto-targets.cmake")
