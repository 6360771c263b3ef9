"""Outside of flight_graph/ros nothing needs Linux: no module, call or file mode that macOS or Windows has not.

What is used all the same stands behind a check: an import inside of ``try`` with ``except ImportError``, a function
of os in a module that asks ``hasattr(os, ...)`` for it. Text files are read and written as UTF-8, whatever the locale, and with the line ends of the source.
"""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ("bags", "flight_graph", "flight_math", "msg_schemas", "sim_nodes", "cubli_ros", "spacerobot_ros", "lander_ros",
           "papers", "scenarios", "requirements")
MODULES = {"fcntl", "grp", "posix", "pty", "pwd", "resource", "select", "spwd", "syslog", "termios", "tty",  # not on Windows
           "msvcrt", "winreg", "_winapi"}  # nowhere else
OS_NAMES = {
    "fork", "forkpty", "getuid", "geteuid", "getgid", "getpgid", "killpg", "kill", "mkfifo", "mknod", "nice", "openpty",
    "posix_fallocate", "posix_fadvise", "pread", "pwrite", "preadv", "pwritev", "readv", "writev", "sched_getaffinity",
    "sched_setaffinity", "sched_yield", "sendfile", "setsid", "setpgid", "statvfs", "sync", "sysconf", "uname", "wait",
    "waitpid", "execv", "execve", "execvp", "memfd_create", "eventfd", "symlink", "link", "O_DIRECTORY", "O_DIRECT",
    "O_NOFOLLOW", "O_TMPFILE", "O_SYNC", "O_DSYNC", "O_NONBLOCK", "O_CLOEXEC"}
SIGNALS = {"SIGKILL", "SIGSTOP", "SIGCONT", "SIGUSR1", "SIGUSR2", "SIGHUP", "SIGALRM", "SIGCHLD", "SIGQUIT", "alarm",
           "setitimer", "pthread_sigmask", "sigwait"}
PROCESS_KEYWORDS = {"process_group", "preexec_fn", "start_new_session", "pass_fds", "user", "group", "umask"}
STREAMS = ("/dev/", "/proc/", "/tmp/", "/bin/", "/usr/", "/etc/")
ALLOWED = {  # file -> what it may say, and why
    "flight_graph/recordings/recording.py": {"/proc/cpuinfo"},  # the processor's name, where it can be read
    "flight_graph/engines/memory.py": {"/proc/meminfo", "/proc/self/statm"},  # what is free, where it can be read
    "flight_graph/bags/disk.py": {"msvcrt"},  # the lock of Windows, after fcntl was not found
}


def sources() -> list[Path]:
    found = [path for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*.py"))]
    return [ROOT / "setup.py", *(path for path in found if ROOT / "flight_graph" / "ros" not in path.parents)]


def findings(tree: ast.AST):
    """(line, what) of everything in a module that is not portable."""
    guarded = {id(inner) for node in ast.walk(tree) if isinstance(node, ast.Try) and _catches_import_error(node)
               for statement in node.body for inner in ast.walk(statement)}
    asked = {node.args[1].value for node in ast.walk(tree) if isinstance(node, ast.Call)
             and getattr(node.func, "id", "") in ("hasattr", "getattr") and isinstance(node.args[1], ast.Constant)}
    for node in ast.walk(tree):
        if isinstance(node, (ast.Import, ast.ImportFrom)) and id(node) not in guarded:
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else [node.module or ""]
            yield from ((node.lineno, name) for name in names if name.partition(".")[0] in MODULES)
            if isinstance(node, ast.ImportFrom) and node.module == "os":
                yield from ((node.lineno, alias.name) for alias in node.names if alias.name in OS_NAMES)
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            if node.attr not in asked and node.attr in {"os": OS_NAMES, "signal": SIGNALS}.get(node.value.id, ()):
                yield node.lineno, f"{node.value.id}.{node.attr}"
        elif isinstance(node, ast.Call):
            yield from ((node.lineno, name) for name in _call(node))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value.startswith(STREAMS):
            yield node.lineno, node.value


def _catches_import_error(node) -> bool:
    return any(isinstance(handler.type, ast.Name) and handler.type.id in ("ImportError", "ModuleNotFoundError")
               for handler in node.handlers)


def _call(node):
    """What is wrong with the keywords of a call: of a text file, or of a process."""
    name = getattr(node.func, "attr", getattr(node.func, "id", ""))
    owner = getattr(getattr(node.func, "value", None), "id", "")
    keywords = {keyword.arg for keyword in node.keywords}
    if owner == "subprocess":
        yield from (f"{name}({keyword}=...)" for keyword in sorted(keywords & PROCESS_KEYWORDS))
        if "text" in keywords or "universal_newlines" in keywords:
            yield f"{name}(text=True): name the encoding"
    if name in ("read_text", "write_text") and "encoding" not in keywords:
        yield f"{name} without encoding"
    if name == "write_text" and "newline" not in keywords:
        yield "write_text without newline"
    if name == "open" and owner not in ("os", "tarfile", "zipfile", "webbrowser"):
        mode = _mode(node)
        if "b" not in mode:
            if "encoding" not in keywords:
                yield "open without encoding"
            if set(mode) & set("wax+") and "newline" not in keywords:
                yield "open for writing without newline"


def _mode(node) -> str:
    place = 1 if isinstance(node.func, ast.Name) else 0  # open(path, mode), path.open(mode)
    given = [keyword.value for keyword in node.keywords if keyword.arg == "mode"] or node.args[place:place + 1]
    return given[0].value if given and isinstance(given[0], ast.Constant) else "r"


@pytest.mark.parametrize("text, found", [
    ("import fcntl", ["fcntl"]),
    ("try:\n    import fcntl\nexcept ImportError:\n    fcntl = None", []),
    ("from os import fork, path", ["fork"]),
    ("os.pwrite(file, data, 0)", ["os.pwrite"]),
    ("if hasattr(os, 'getuid'):\n    os.getuid()", []),
    ("signal.signal(signal.SIGTERM, stop)", []),
    ("signal.alarm(3)", ["signal.alarm"]),
    ("subprocess.Popen(a, process_group=0)", ["Popen(process_group=...)"]),
    ("subprocess.run(a, text=True)", ["run(text=True): name the encoding"]),
    ("open('a')", ["open without encoding"]),
    ("open('a', 'rb')", []),
    ("path.open('w', encoding='utf-8')", ["open for writing without newline"]),
    ("path.write_text(t)", ["write_text without encoding", "write_text without newline"]),
    ("Path('/dev/shm')", ["/dev/shm"]),
])
def test_the_check_finds(text, found):
    assert [what for _, what in findings(ast.parse(text))] == found


def test_nothing_needs_linux():
    wrong = []
    for path in sources():
        name = path.relative_to(ROOT).as_posix()
        for line, what in findings(ast.parse(path.read_text(encoding="utf-8"))):
            if what not in ALLOWED.get(name, ()):
                wrong.append(f"{name}:{line}: {what}")
    assert not wrong, "\n".join(wrong)
