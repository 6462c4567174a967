"""PlatformIO where its package registry is out of reach: stand-ins from PyPI and Debian.

`pio test -e native` wants four packages from the registry. Each has a twin that reaches a machine
by another way, and PlatformIO takes a package folder as it is when folder and version are right:

    platform native     a few lines of SCons (below)
    tool-scons          SCons from PyPI, already in .venv
    Eigen               the headers of PyPI's cmeel-eigen, already in .venv
    Unity               the sources in Debian's binary package `cmock`, or in the source package
                        `ntpsec`, from the mirror this machine's own apt uses

Nothing is written outside build/pio, or PLATFORMIO_CORE_DIR if that is set. The firmware's
compiler and framework have no twin: `pio run -e teensy41` needs the registry.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import urllib.error
import urllib.request
from pathlib import Path

from machine import ROOT, fail, install, say

HOME = ROOT / "build" / "pio"
UNITY = HOME / "unity"
KEYS = Path("/usr/share/keyrings/debian-archive-keyring.gpg")

# Versions that satisfy platformio.ini and PlatformIO itself, and still say what they are.
NATIVE = "1.2.1"
SCONS = "4.41101.0"
EIGEN = "3.0.2+eigen.3.4.0"
UNITY_WANTED = "2.6.1"

NATIVE_BUILDER = '''\
"""Stand-in for PlatformIO's platform `native`: compile and link with the machine's g++."""
from SCons.Script import Default, DefaultEnvironment

env = DefaultEnvironment()
ours = {name: env.get(name, [])[:] for name in ("CFLAGS", "CXXFLAGS")}  # the tools reset them
env.Tool("gcc")
env.Tool("g++")
env.Append(**ours)
Default([env.BuildProgram()])
'''
RUN_SCONS = "from SCons.Script.Main import main\n\nmain()\n"


def environment(target: str = "native") -> dict[str, str]:
    """The variables to run `pio` with, after making sure that what it needs is there."""
    variables = {
        **os.environ,
        "PLATFORMIO_SETTING_ENABLE_TELEMETRY": "no",
        "PLATFORMIO_DISABLE_UPGRADE_CHECK": "true",
    }
    if installed_from_registry(target) or registry_answers():
        return variables
    if target != "native":
        fail("the Teensy's compiler and core come from PlatformIO's registry: it does not answer")
    core = Path(os.environ.get("PLATFORMIO_CORE_DIR") or HOME / "core").absolute()
    libraries = HOME / "libdeps"
    variables["PLATFORMIO_CORE_DIR"] = str(core)
    variables["PLATFORMIO_LIBDEPS_DIR"] = str(libraries)
    put_stand_ins(core, libraries / "native")
    # PlatformIO deletes libraries that a change of lib_deps made superfluous, and cannot fetch
    # their successors: let it forget what was there before.
    (libraries / "native" / "integrity.dat").unlink(missing_ok=True)
    return variables


def installed_from_registry(target: str) -> bool:
    """All is there from an earlier run: no need to ask, and good for a train without network."""
    core = Path(os.environ.get("PLATFORMIO_CORE_DIR") or "~/.platformio").expanduser()
    platform = {"native": "native", "teensy41": "teensy"}[target]
    libraries = ROOT / ".pio/libdeps" / target  # stand-ins are never put here
    places = (core / "platforms" / platform, core / "packages/tool-scons", libraries / "Unity")
    return all(place.is_dir() for place in places)


def registry_answers() -> bool:
    """One small question. In a process of its own, as looking up a name knows no time limit."""
    try:
        question = [sys.executable, __file__, "ask-registry"]
        return subprocess.run(question, check=False, timeout=6).returncode == 0
    except subprocess.TimeoutExpired:
        return False


def ask_registry() -> bool:
    from platformio import __registry_mirror_hosts__ as hosts

    url = f"https://api.{hosts[0]}/v3/packages/platformio/platform/native"
    try:
        with urllib.request.urlopen(url, timeout=5) as answer:
            return bool(answer.status == 200)
    except (OSError, urllib.error.URLError):
        return False


def put_stand_ins(core: Path, libraries: Path) -> None:
    """Small enough to be written each time, so that a half-finished run leaves nothing to mend."""
    unity_version = get_unity()
    native = core / "platforms" / "native"
    about = {"name": "native", "title": "Native", "version": NATIVE}
    put(native / "platform.json", json.dumps(about))
    put(native / "builder" / "main.py", NATIVE_BUILDER)
    put(native / ".piopm", receipt("platform", "native", NATIVE, "platformio"))

    scons = core / "packages" / "tool-scons"
    put(scons / "package.json", json.dumps({"name": "tool-scons", "version": SCONS}))
    put(scons / "scons.py", RUN_SCONS)
    put(scons / ".piopm", receipt("tool", "tool-scons", SCONS, "platformio"))

    eigen_headers = Path(sysconfig.get_path("purelib"), "cmeel.prefix/include/eigen3/Eigen")
    put_library(libraries, "Bolder Flight Systems Eigen", EIGEN, "bolderflight", eigen_headers)
    put_library(libraries, "Unity", f"{UNITY_WANTED}+{unity_version}", "throwtheswitch", UNITY)


def put_library(libraries: Path, name: str, version: str, owner: str, headers: Path) -> None:
    folder = libraries / name
    put(folder / "library.json", json.dumps({"name": name, "version": version}))
    put(folder / ".piopm", receipt("library", name, version, owner))
    link = folder / "src" / headers.name if headers.name == "Eigen" else folder / "src"
    if not (link.is_symlink() and link.readlink() == headers):
        link.unlink(missing_ok=True)
        link.parent.mkdir(parents=True, exist_ok=True)
        link.symlink_to(headers)


def receipt(kind: str, name: str, version: str, owner: str) -> str:
    """What PlatformIO writes beside a package that it has installed."""
    spec = {"owner": owner, "id": None, "name": name, "requirements": None, "uri": None}
    return json.dumps({"type": kind, "name": name, "version": version, "spec": spec})


def put(file: Path, text: str) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    if not file.exists() or file.read_text() != text:
        file.write_text(text)


# ---- Unity, from Debian -------------------------------------------------------------------------


def get_unity() -> str:
    """Have Unity's sources in build/pio/unity and return where they are from, as a version tag."""
    origin = UNITY / "origin"
    if not origin.exists():
        say("PlatformIO's registry cannot be reached: fetching Unity from the Debian mirror")
        fetch_unity()
    return origin.read_text()


def fetch_unity() -> None:
    if not (shutil.which("apt-get") and shutil.which("dpkg-deb")):
        fail("no apt-get here to fetch Unity with: run this once where the registry answers")
    if not KEYS.exists():
        install(["debian-archive-keyring"])
    work = HOME / "apt"
    for mirror in debian_mirrors():
        for fetch in (unity_from_cmock, unity_from_ntpsec):
            shutil.rmtree(work, ignore_errors=True)
            found = fetch(mirror, work)
            if found:
                keep_unity(*found)
                shutil.rmtree(work)
                return
    fail(f"no mirror of this machine offers Unity (packages cmock, ntpsec): see {HOME}/apt.log")


def debian_mirrors() -> list[str]:
    """The addresses this machine's own apt uses for Debian, read from it and never written down."""
    columns = "$(CREATED_BY) $(COMPONENT) $(REPO_URI)"
    command = ["apt-get", "indextargets", "--no-release-info", "--format", columns]
    listing = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    mirrors = []
    for line in listing.splitlines():
        kind, component, uri = line.split(maxsplit=2)
        if kind == "Packages" and component == "main" and "security" not in uri:
            mirrors.append(uri)
    return list(dict.fromkeys(mirrors))


def unity_from_cmock(mirror: str, work: Path) -> tuple[Path, str] | None:
    """The binary package `cmock` of Debian 13 carries Unity 2.5.4."""
    if not apt(work, f"deb [signed-by={KEYS}] {mirror} trixie main", "download", "cmock"):
        return None
    (package,) = work.glob("cmock_*.deb")
    subprocess.run(["dpkg-deb", "-x", str(package), str(work / "root")], check=True)
    return work / "root/usr/share/cmock/vendor/unity/src", "debian.cmock.unity.2.5.4"


def unity_from_ntpsec(mirror: str, work: Path) -> tuple[Path, str] | None:
    """The source package `ntpsec` of Debian 12 carries Unity 2.5.1 for its own tests."""
    source = f"deb-src [signed-by={KEYS}] {mirror} bookworm main"
    if not apt(work, source, "source", "--download-only", "ntpsec"):
        return None
    (package,) = work.glob("ntpsec_*.orig.tar.*")
    with tarfile.open(package) as archive:
        for member in archive.getmembers():
            name = Path(member.name)
            content = archive.extractfile(member) if name.parent.match("tests/unity") else None
            if content:
                (work / name.name).write_bytes(content.read())
    return work, "debian.ntpsec.unity.2.5.1"


def apt(work: Path, source: str, *command: str) -> bool:
    """Run apt-get with a configuration of its own: needs no root, touches nothing of the machine's.

    Proxies and the like in /etc/apt/apt.conf.d stay in force, and signatures are checked as usual.
    """
    (work / "lists" / "partial").mkdir(parents=True)
    (work / "cache" / "archives" / "partial").mkdir(parents=True)
    (work / "sources.list").write_text(source + "\n")
    (work / "status").touch()
    settings = {
        "Dir::Etc::SourceList": work / "sources.list",
        "Dir::Etc::SourceParts": "/dev/null",
        "Dir::State::Lists": work / "lists",
        "Dir::State::status": work / "status",
        "Dir::Cache": work / "cache",
        "Dir::Etc::PreferencesParts": "/dev/null",
        "Debug::NoLocking": "true",
        "APT::Sandbox::User": "",
        "APT::Get::List-Cleanup": "false",
        "Acquire::Languages": "none",
        "Acquire::Retries": "1",
        "Acquire::http::Timeout": "20",
        "Acquire::https::Timeout": "20",
    }
    options = [word for key, value in settings.items() for word in ("-o", f"{key}={value}")]
    log = HOME / "apt.log"
    with log.open("a") as output:
        for step in (["update"], list(command)):
            call = ["apt-get", "-q", *options, *step]
            if subprocess.run(call, cwd=work, stdout=output, stderr=output, check=False).returncode:
                return False
    return True


def keep_unity(sources: Path, origin: str) -> None:
    """Unity is three files; `origin` comes last and says that they are all there."""
    partial = UNITY.with_suffix(".partial")
    shutil.rmtree(partial, ignore_errors=True)
    partial.mkdir(parents=True)
    for name in ("unity.c", "unity.h", "unity_internals.h"):
        shutil.copyfile(sources / name, partial / name)
    (partial / "origin").write_text(origin)
    shutil.rmtree(UNITY, ignore_errors=True)
    partial.rename(UNITY)


if __name__ == "__main__":
    raise SystemExit(0 if sys.argv[1:] == ["ask-registry"] and ask_registry() else 1)
