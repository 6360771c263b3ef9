"""Runs in Rerun: a moving 3-D picture with plots beside it, in its window, in a browser, or as an ``.rrd`` file."""

import os
import sys

import numpy as np

from flight_graph.bags.errors import BagError
from flight_graph.bags.reader import Bag
from flight_graph.errors import FlightError
from flight_graph.scenes.scene import Scene
from flight_graph.timebase import SECOND
from flight_graph.viewers import rerun_scene
from flight_graph.viewers.extras import required
from flight_graph.viewers.overview import by_topic, overview
from flight_graph.viewers.series import Series, all_series

TIMELINE = "time"  # seconds since the first message
PLOTS = "plots"
MOST_POINTS = 20_000  # of a series, and poses of a frame
COMMAND = "flight view"


class RerunStream:
    """Bags, one after the other of one run, as one recording of Rerun. begin_ns: stamp of time zero.

    notes: sentences of what a person should know (what was thinned, what cannot be read, why there is no picture).
    """

    def __init__(self, name: str, scene: Scene | None, begin_ns: int, most_points: int = MOST_POINTS):
        self._rerun = required("rerun", "view", COMMAND)
        self.name, self.scene, self.notes = name, scene, []
        self._begin_ns, self._most, self._is_thinned, self._titled = begin_ns, most_points, False, set()
        self._recording = self._rerun.RecordingStream(application(scene), send_properties=False)
        self._recording.send_recording_name(name)
        self._moving = None
        if scene is not None:
            self._moving = rerun_scene.MovingScene(self._rerun, self._recording, scene, self._time, self._thinned)

    # -- where it goes ---------------------------------------------------------------------------------------------
    def save(self, path) -> None:
        """Write into a new file. Raises FlightError."""
        try:
            with open(path, "xb"):
                pass
            self._recording.save(path)
        except FileExistsError:
            raise FlightError(f"--save {path}: it exists already; name a new file") from None
        except OSError as error:
            raise FlightError(f"--save {path}: it cannot be written ({(error.strerror or str(error)).lower()})") from None

    def serve(self, web_port: int, grpc_port: int, open_browser: bool) -> str:
        """Serve the viewer as a page; its address. Raises FlightError where the ports cannot be had."""
        try:
            source = self._recording.serve_grpc(grpc_port=grpc_port)
            self._rerun.serve_web_viewer(web_port=web_port, open_browser=open_browser, connect_to=source)
        except (RuntimeError, OSError, ValueError) as error:
            raise FlightError(f"--web: ports {web_port} (page) and {grpc_port} (data) cannot both be served on ({error}); "
                              "--port NUMBER takes others") from None
        from urllib.parse import quote
        return f"http://127.0.0.1:{web_port}/?url={quote(source, safe='')}"

    def open_window(self) -> None:
        """Start the native viewer. Raises FlightError where there is no display."""
        refuse_without_display()
        try:
            self._recording.spawn()
        except (RuntimeError, OSError) as error:
            raise FlightError(f"{COMMAND}: the viewer does not start ({error}); --web shows it in a browser") from None

    # -- what is in it ---------------------------------------------------------------------------------------------
    def begin(self, series: list[Series]) -> None:
        """Send the blueprint, and what stands still. series: what will be plotted."""
        if self.scene is not None:
            rerun_scene.log_shapes(self._rerun, self._recording, self.scene)
        self._recording.send_blueprint(blueprint(self._rerun, self.scene, series))

    def add(self, bag: Bag) -> list[Series]:
        """Log all that a bag holds; its series. What cannot be read or drawn is said in ``notes``."""
        series, problems = all_series(bag)
        self.notes += [f"not shown: {sentence}" for sentence in problems.values()]
        if self._moving is not None:
            try:
                self._moving.add(bag)
            except BagError as error:
                self.notes.append(f"nothing moves in the picture: {error}")
        for one in series:
            self._plot(bag, one)
        return series

    def _plot(self, bag, one):
        entity, stamps = entity_of(one), bag.stamps_ns(one.topic)
        if entity not in self._titled:
            self._titled.add(entity)
            self._recording.log(entity, self._rerun.SeriesLines(names=[line.label for line in one.lines]), static=True)
        rows = self._thinned(stamps)
        scalars = self._rerun.Scalars.columns(scalars=one.values[rows].reshape(-1))
        self._recording.send_columns(entity, self._time(stamps[rows]), scalars.partition([len(one.lines)] * len(rows)))

    def _time(self, stamps_ns):
        seconds = (np.asarray(stamps_ns, np.int64) - self._begin_ns) / SECOND
        return [self._rerun.TimeColumn(TIMELINE, duration=seconds)]

    def _thinned(self, stamps_ns) -> np.ndarray:
        """The rows to show: all of them, or every k-th and the last."""
        count = len(stamps_ns)
        step = max(1, -(-count // self._most))
        if step > 1 and not self._is_thinned:
            self._is_thinned = True
            self.notes.append(f"thinned: of topics with more than {self._most} messages, every k-th is shown "
                              "(--points says how many)")
        rows = np.arange(0, count, step)
        return rows if not count or rows[-1] == count - 1 else np.append(rows, count - 1)

    def flush(self) -> None:
        """Wait until all has gone out."""
        self._recording.flush(timeout_sec=60.0)

    def close(self) -> None:
        """End the recording."""
        self.flush()
        self._recording.disconnect()


def application(scene: Scene | None) -> str:
    """What Rerun keeps a person's own arrangement of views by: the vehicle."""
    return f"flight_graph {scene.name}" if scene is not None else "flight_graph"


def entity_of(series: Series) -> str:
    """Where the numbers of a series are in a recording, as a path."""
    import rerun
    return "/".join([PLOTS, *(rerun.escape_entity_path_part(part)
                              for part in (*filter(None, series.topic.split("/")), series.name))])


def blueprint(rerun, scene: Scene | None, series: list[Series]):
    """The arrangement of a vehicle: picture and overview beside each other, then a tab for each topic."""
    import rerun.blueprint as rrb
    beside = rrb.Vertical(*(_view(rrb, plot.title + (f" [{plot.unit}]" if plot.unit else ""), plot.series)
                            for plot in overview(series)))
    tabs = [rrb.Vertical(*(_view(rrb, one.title, (one,)) for one in some), name=topic)
            for topic, some in by_topic(series).items()]
    if scene is None:
        first = beside
    else:
        since = rerun.VisibleTimeRange(TIMELINE, start=rerun.TimeRangeBoundary.infinite(),
                                       end=rerun.TimeRangeBoundary.cursor_relative())
        shown = {path: rrb.VisibleTimeRanges([since]) for path in rerun_scene.trails(scene)}
        picture = rrb.Spatial3DView(origin=rerun_scene.ROOT, name=scene.name, overrides=shown)
        first = rrb.Horizontal(picture, beside, column_shares=[3, 2]) if series else picture
    return rrb.Blueprint(
        rrb.Tabs(rrb.Horizontal(first, name="overview"), *tabs, active_tab="overview"),
        rrb.BlueprintPanel(state="collapsed"), rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE, play_state="playing"))


def _view(rrb, title, series):
    return rrb.TimeSeriesView(origin="/", contents=[f"+ /{entity_of(one)}" for one in series], name=title)


def refuse_without_display() -> None:
    """Refuse a window where none can be shown. Raises FlightError."""
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise FlightError(f"{COMMAND}: there is no display here (neither DISPLAY nor WAYLAND_DISPLAY is set); --web shows "
                          "it in a browser, also on another machine; --save FILE.rrd keeps it for later")
