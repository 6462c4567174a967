"""PlatformIO build script: be strict with our own C++, and with nobody else's.

Our sources, and the headers of lib/ and include/ that they include, are compiled with the flags
that platformio.ini lists as custom_own_flags. Arduino, Eigen and Unity are not ours to correct:
their directories move from -I to -isystem, where the compiler keeps quiet about them.

(build_src_flags will not do: PlatformIO compiles a C file of its own with them.)
"""

from pathlib import Path

Import("projenv")  # noqa: F821  (SCons puts this name here, and the next)
env = projenv  # noqa: F821

PROJECT = Path(env.subst("$PROJECT_DIR")).resolve()
OURS = [PROJECT / name for name in ("src", "include", "lib", "test")]


def is_ours(directory: Path) -> bool:
    return any(own == directory or own in directory.parents for own in OURS)


# An editor that asks PlatformIO for include paths reads CPPPATH alone: leave it whole for that.
if not env.IsIntegrationDump():
    directories = [Path(env.Dir(path).get_abspath()).resolve() for path in env["CPPPATH"]]
    env.Replace(CPPPATH=[str(d) for d in directories if is_ours(d)])
    env.Append(CCFLAGS=[("-isystem", str(d)) for d in directories if not is_ours(d)])
    env.Append(CXXFLAGS=env.GetProjectOption("custom_own_flags").split())
