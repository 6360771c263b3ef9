"""Making machine code that is not in the cache yet: several components at a time, each in a process of its own."""

import json
import os
import queue
import subprocess
import sys
import threading
from dataclasses import dataclass, field

from flight_graph.components import kernel_rules, namespaces
from flight_graph.components.component import Component
from flight_graph.engines import driver, parts
from flight_graph.engines.cache import cache_folder
from flight_graph.engines.moved import made_of
from flight_graph.errors import FlightError

HERE = "FLIGHT_COMPILE_HERE"  # 1 in the environment: compile in this process
_LOADING = threading.Lock()  # runs of a sweep are threads of one process


class CompilationFailed(FlightError):
    """A component that the compiler did not take. trace: what the compiler said."""

    def __init__(self, sentence: str, trace: str = ""):
        super().__init__(sentence)
        self.trace = trace


@dataclass
class _Task:
    """What one process compiles in one go: a component's parts, or the driver."""

    name: str
    jobs: list[dict] = field(default_factory=list)
    is_own: bool = False  # a user's own file: its errors are wanted first
    lines: int = 0  # of the kernels that it reaches: the longest first, so that no process works alone at the end


def is_ready(components: dict[str, type[Component]], check_bounds: bool = False) -> bool:
    """Whether all machine code of these components lies in the cache. components: use -> class."""
    return driver.CODE.is_ready() and not any(parts.missing(component, check_bounds) for component in components.values())


def compile_missing(components: dict[str, type[Component]], check_bounds: bool = False, progress=None,
                    jobs: int | None = None) -> int:
    """Compile what is not in the cache; return the number of components. Raises FlightError.

    components: use -> class. progress(done, in all, name of what comes next) is called from this thread. jobs: processes
    at a time (default: one a core).
    """
    tasks = _tasks(components, check_bounds)
    if tasks:
        _work(tasks, progress, jobs)
    return len(tasks) - any("driver" in job for task in tasks for job in task.jobs)


def compile_kept(name: str, key: str) -> None:
    """Compile a kernel over arrays, see `flight_graph.engines.kept`."""
    _work([_Task(name, [{"kept": name, "key": key}])], None, 1)


def compile_jobs(jobs: dict[str, list[dict]], progress=None) -> None:
    """Do jobs of the compiler's, by the name of what they are for. Raises FlightError. progress: as `compile_missing`."""
    with _LOADING:
        _work([_Task(name, found) for name, found in jobs.items() if found], progress, None)


def _work(tasks, progress, jobs):
    if os.environ.get(HERE) == "1":
        _work_here(tasks, progress)
        return
    waiting, answers, workers = queue.SimpleQueue(), queue.SimpleQueue(), []
    for task in tasks:
        waiting.put(task)
    count = min(jobs or os.cpu_count() or 1, len(tasks))
    try:
        for _ in range(count):
            workers.append(_Worker(waiting, answers))
        running, done = {}, 0
        while done < len(tasks):
            kind, worker, value = answers.get()
            if kind == "failed":
                raise value
            if kind == "begun":
                running[worker] = value.name
            else:
                running.pop(worker, None)
                done += 1
            if progress:
                progress(done, len(tasks), ", ".join(running.values()))
    finally:
        for worker in workers:
            worker.end()


def load(components: dict[str, type[Component]], check_bounds: bool = False, progress=None) -> dict[str, dict]:
    """use -> part -> machine code of components, compiled where it is not in the cache. Raises FlightError."""
    with _LOADING:
        return _load(components, check_bounds, progress)


def _load(components, check_bounds, progress):
    compile_missing(components, check_bounds, progress)
    for component in components.values():
        if parts.load(component, check_bounds) is None:  # a spoiled file: made anew
            parts.forget(component, check_bounds)
    driver.CODE.forget_spoiled()
    compile_missing(components, check_bounds, progress)
    found = {use: parts.load(component, check_bounds) for use, component in components.items()}
    broken = [use for use, codes in found.items() if codes is None] + ([] if driver.CODE.is_loadable() else ["the driver"])
    if broken:
        raise FlightError(f"the machine code of {', '.join(broken)} cannot be read back from '{cache_folder('objects')}'")
    return found


def _tasks(components, check_bounds):
    tasks, seen = [], set()
    for use, component in components.items():
        if (plain := made_of(component)) is not component:
            use, component = namespaces.split(use)[0], plain
        task = _Task(use, is_own=use.rpartition(":")[0].endswith(".py"))
        for part in parts.missing(component, check_bounds):
            key = parts.key(component, part, check_bounds)
            if key not in seen:
                seen.add(key)
                task.jobs.append({"use": use, "part": part, "key": key, "check_bounds": check_bounds})
        if task.jobs:
            kernel_rules.check(component)
            task.lines = sum(source.tree.end_lineno - source.tree.lineno for source in kernel_rules.reached(component))
            tasks.append(task)
    if not driver.CODE.is_ready():
        tasks.append(_Task("the driver", [{"driver": driver.CODE.key}]))
    return sorted(tasks, key=lambda task: (not task.is_own, -task.lines))


def _work_here(tasks, progress):
    """Compile in this process: where it cannot start another one of its kind (an emulated processor)."""
    from flight_graph.engines import compiler, object_code
    with object_code.installed():
        for done, task in enumerate(tasks):
            if progress:
                progress(done, len(tasks), task.name)
            for job in task.jobs:
                _judge(task, job, compiler.answer(job))


def _judge(task, job, answer):
    """Raise what an answer of the compiler's says. Raises FlightError."""
    if "refused" in answer:
        raise FlightError(answer["refused"])
    if "error" in answer:
        what = f"{task.name}{', ' + job['part'] if 'part' in job else ''}"
        raise CompilationFailed(f"{what}: it cannot be compiled: {answer['error']}", answer["error"])


class _Worker:
    """A compiling process and the thread that feeds it."""

    def __init__(self, waiting, answers):
        self._waiting, self._answers = waiting, answers
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path or os.getcwd() for path in sys.path),
                       "NUMBA_DISABLE_JIT": "0"}
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "flight_graph.engines.compiler", str(os.getpid())], stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, encoding="utf-8", env=environment)
        threading.Thread(target=self._feed, daemon=True).start()

    def _feed(self):
        try:
            while True:
                try:
                    task = self._waiting.get_nowait()
                except queue.Empty:
                    return
                self._answers.put(("begun", self, task))
                for job in task.jobs:
                    self._ask(task, job)
                self._answers.put(("done", self, task))
        except FlightError as error:
            self._answers.put(("failed", self, error))

    def _ask(self, task, job):
        try:
            self._process.stdin.write(json.dumps(job) + "\n")
            self._process.stdin.flush()
            line = self._process.stdout.readline()
        except (OSError, ValueError):
            line = ""
        if not line:
            raise FlightError(f"{task.name}: its compiler ended by itself (status {self._process.wait()})")
        _judge(task, job, json.loads(line))

    def end(self):
        """End the process."""
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            try:
                pipe.close()
            except OSError:
                pass
