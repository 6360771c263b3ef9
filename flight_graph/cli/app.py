"""The commands of ``flight``, each in a module of its own; heavy imports happen inside the commands."""

import typer

from flight_graph.cli import (
    bags,
    check,
    claims,
    compile,
    demo,
    design,
    doctor,
    export_c,
    fault,
    identify,
    layout,
    plot,
    rare,
    replay,
    report,
    scenarios,
    serve,
    step,
    sweep,
    urdf,
    view,
)

app = typer.Typer(
    name="flight", no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False, rich_markup_mode="markdown",
    help="Simulated flight software for spacecraft at small bodies: run, record, judge.\n\n"
         "Example: flight run cubli_asteroid")
scenarios.register(app)
step.register(app)
view.register(app)
serve.register(app)
layout.register(app)
urdf.register(app)
check.register(app)
compile.register(app)
fault.register(app)
sweep.register(app)
report.register(app)
plot.register(app)
bags.register(app)
replay.register(app)
rare.register(app)
claims.register(app)
design.register(app)
identify.register(app)
export_c.register(app)
demo.register(app)
doctor.register(app)
