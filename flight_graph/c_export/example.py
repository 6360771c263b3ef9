"""The program that flies a recorded bag's inputs through an exported component, and the CMake file around it."""

import numpy as np

from flight_graph.bags.errors import quoted
from flight_graph.components.component import Component
from flight_graph.engines.part_calls import fired, ports
from flight_graph.errors import FlightError
from flight_graph.recordings.recorded_run import RecordedRun
from flight_graph.replays.replay import comparable_topics, recorded_inputs

CMAKE = """cmake_minimum_required(VERSION 3.16)
project({name} C)
add_library({name} STATIC IMPORTED)
set_target_properties({name} PROPERTIES
  IMPORTED_LOCATION ${{CMAKE_CURRENT_SOURCE_DIR}}/lib{name}.a
  INTERFACE_INCLUDE_DIRECTORIES ${{CMAKE_CURRENT_SOURCE_DIR}})
add_executable(fly main.c {name}_data.c)
target_compile_features(fly PRIVATE c_std_11)
target_link_libraries(fly PRIVATE {name}{libraries})
"""
MAIN = """/* Flies {use} on recorded inputs and compares every byte: fly firings.bin
   cc -std=c11 -O2 main.c {name}_data.c -L. -l{name}{flags} -o fly */
#include <stdio.h>
#include <time.h>
#include "{name}.h"

struct firing {{ /* of firings.bin */
  int64_t t_ns, stamp_ns;
{fields}}};

static double seconds(void) {{
  struct timespec now;
  timespec_get(&now, TIME_UTC);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}}

#define STACK 65536

/* paint = 1: paint the stack below; 0: how much of it has been used since */
static __attribute__((noinline)) long stack(int paint) {{
  volatile uint8_t area[STACK], *volatile at = area;
  long i = 0;
  if (paint)
    for (i = 0; i < STACK; i++) at[i] = 0xA5;
  else
    while (i < STACK && at[i] == 0xA5) i++;
  return STACK - i;
}}

int main(int count, char **words) {{
  static struct {name}_parameters p;
  static struct {name}_state x;
{records}  static struct firing f;
  long firings = 0, deepest = 0;
  double worst = 0.0, all = 0.0;
  FILE *file = count > 1 ? fopen(words[1], "rb") : NULL;
  if (!file) return fprintf(stderr, "fly firings.bin\\n"), 2;
  {name}_begin(&p, &x);
{blanks}{start}  while (fread(&f, sizeof f, 1, file) == 1) {{
{stamps}    stack(1);
    double began = seconds();
{calls}    double spent = seconds() - began;
    long used = stack(0);
    deepest = used > deepest ? used : deepest;
    all += spent;
    worst = spent > worst ? spent : worst;
    if (x.fault) return fprintf(stderr, "stopped at %lld ns: fault %lld\\n", (long long)f.t_ns, (long long)x.fault), 1;
{compared}    firings++;
  }}
  fclose(file);
  printf("%ld firings, equal byte for byte; %.3f us each, %.3f us and %ld bytes of stack at most\\n", firings,
         firings ? 1e6 * all / firings : 0.0, 1e6 * worst, deepest);
  return firings ? 0 : 1;
}}
"""


def main_c(component: type[Component], use: str, name: str, needs_libm: bool) -> str:
    """The program."""
    inputs, outputs, macro = list(component.inputs), list(component.outputs), name.upper()
    calls = []
    for part in fired(component):
        taken, made = ports(component, part)
        io = "".join(f", &{side}_{port}" for side, some in (("in", taken), ("out", made)) for port in some)[2:]
        if part in ("kernel", "update"):
            calls += [f"    in_{port} = f.{port};" for port in inputs]
        calls.append(f"    {name}_{part}(f.t_ns, &p, &x, (void *[]){{{io or '0'}}});")
    compared = [line for port in outputs for line in (
        f"    if (f.has_{port} && memcmp(&out_{port}, f.{port}, {macro}_{port.upper()}_SIZE))",
        f'      return fprintf(stderr, "{port} differs at %lld ns\\n", (long long)f.t_ns), 1;')]
    def lines(some):
        return "".join(f"{line}\n" for line in some)
    return MAIN.format(
        use=use, name=name, flags=" -lm" if needs_libm else "", fields=lines(
            [f"  struct {name}_{port}_message {port};" for port in inputs]
            + [f"  int64_t has_{port};\n  uint8_t {port}[({macro}_{port.upper()}_SIZE + 7) / 8 * 8];" for port in outputs]),
        records=lines([f"  static struct {name}_{port}_message in_{port};" for port in inputs]
                      + [f"  static struct {name}_{port}_message out_{port};" for port in outputs]),
        blanks=lines([f"  {name}_blank_{port}(&in_{port});" for port in inputs]
                     + [f"  {name}_blank_{port}(&out_{port});" for port in outputs]),
        start=f"  {name}_start(0, &p, &x, 0);\n" if component.start is not None else "",
        stamps=lines([f"    {name}_stamp(&out_{port}, {macro}_{port.upper()}_STAMP, f.stamp_ns);" for port in outputs]),
        calls=lines(calls), compared=lines(compared))


def firings(run: RecordedRun, node) -> bytes:
    """What ``fly`` reads: each firing of a component in a recorded run, with its inputs and answers. Raises FlightError."""
    where = f"bag {quoted(run.bag.path)}"
    if run.begin or run.is_realtime or not run.complete:
        raise FlightError(f"{where}: needed is a whole run in lockstep that began at t = 0")
    if run.scenario.faults.concerns(node.name):
        raise FlightError(f"{where}: {node.name} has faults or events in this run, which the engine makes; take a run "
                          "without")
    inputs, signals = recorded_inputs(run, node), run.signals
    known = {topic.port: topic for topic in comparable_topics(run, node.name) if topic.formatted is None}
    answers = {port: (run.bag.stamps_ns(f"/{topic.topic}") - run.scenario.epoch_ns, signals[topic.topic])
               for port, topic in known.items()}
    end_ns = min([run.scenario.duration_ns, *(entry.end_ns for entry in inputs.values())])
    return b"".join(_firing(run, node, inputs, answers, t_ns) for t_ns in range(0, end_ns, node.period_ns))


def _firing(run, node, inputs, answers, t_ns) -> bytes:
    found = [np.array([t_ns, run.scenario.epoch_ns + t_ns], "<i8").tobytes()]
    for port, signal in node.component.inputs.items():
        row = inputs[port].index(t_ns) if port in inputs else -1
        record = signal.new()[1] if row < 0 else inputs[port].records[row:row + 1]
        found.append(_padded(record.tobytes(), signal.dtype.itemsize))
    for port, signal in node.component.outputs.items():
        stamps, records = answers.get(port, (np.empty(0, np.int64), None))
        row = int(np.searchsorted(stamps, t_ns))
        is_there = row < len(stamps) and stamps[row] == t_ns
        found += [np.array([is_there], "<i8").tobytes(),
                  _padded(records[row:row + 1].tobytes()[:signal.size] if is_there else b"", signal.size)]
    return b"".join(found)


def _padded(content: bytes, size: int) -> bytes:
    """Content with zeros up to the next multiple of eight bytes of a size."""
    return content.ljust(-(-size // 8) * 8, b"\0")
