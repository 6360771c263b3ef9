"""Runs in Rerun: a moving 3-D picture with plots beside it, in its window, in a browser, or as an ``.rrd`` file."""

import contextlib
import tempfile
from pathlib import Path

import numpy as np

from flight_graph.bags.errors import BagError
from flight_graph.bags.reader import Bag
from flight_graph.bags.series import Series
from flight_graph.errors import FlightError
from flight_graph.extras import required
from flight_graph.scenes import motion
from flight_graph.scenes.scene import Scene
from flight_graph.timebase import SECOND
from flight_graph.viewers import rerun_scene
from flight_graph.viewers.display import refuse_without_display
from flight_graph.viewers.opening import all_series
from flight_graph.viewers.vehicle import Vehicle

TIMELINE = "time"  # seconds since the first message
PLOTS = "plots"
MOST_POINTS = 20_000  # of a series, and poses of a frame
MARGIN = 0.05  # of a plot's height, above and below its lines
_FROM = (1.1, -1.6, 0.9)  # where the eye is, in extents of the scene
_COLOURS = [(31, 119, 180), (214, 39, 40), (44, 160, 44), (148, 103, 189), (255, 127, 14), (23, 190, 207), (140, 86, 75),
            (227, 119, 194), (127, 127, 127), (188, 189, 34), (0, 0, 128), (0, 100, 0)]  # of the lines of a topic


class RerunStream:
    """Bags, one after the other of one run, as one recording of Rerun. begin_ns: stamp of time zero.

    notes: sentences of what a person should know (what was thinned, what cannot be read, why there is no picture).
    """

    def __init__(self, name: str, scene: Scene | None, begin_ns: int, most_points: int = MOST_POINTS,
                 command: str = "flight view"):
        self._rerun, self._command = required("rerun", "view", command), command
        self.name, self.scene, self._said, self._still = name, scene, [], ""
        self._begin_ns, self._most, self._is_thinned = begin_ns, most_points, False
        self._titled, self._lines = set(), {}
        self._recording = self._rerun.RecordingStream(application(scene), send_properties=False)
        self._recording.send_recording_name(name)
        self._moving, self._has_moved = None, False
        if scene is not None:
            self._moving = rerun_scene.MovingScene(self._rerun, self._recording, scene, self._time, self._thinned)

    @property
    def notes(self) -> list[str]:
        """Sentences of what a person should know, each once."""
        return [*dict.fromkeys(self._said), *([self._still] if self._still and not self._has_moved else [])]

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

    def connect(self, source: str) -> None:
        """Send to a server of Rerun's, as `flight_graph.viewers.rerun_page` starts one."""
        self._recording.connect_grpc(source)

    def open_window(self) -> None:
        """Start the native viewer. Raises FlightError where there is no display."""
        refuse_without_display(self._command)
        try:
            self._recording.spawn()
        except (RuntimeError, OSError) as error:
            raise FlightError(f"{self._command}: the viewer does not start ({error}); "
                              "--web shows it in a browser") from None

    # -- what is in it ---------------------------------------------------------------------------------------------
    def begin(self, series: list[Series], target=(0.0, 0.0, 0.0)) -> None:
        """Send the blueprint, and what stands still. series: what will be plotted; target: see `blueprint`."""
        self._recording.send_blueprint(blueprint(
            self._rerun, Vehicle.of(self.name, self.scene, series), target))
        if self.scene is not None:
            at_start = self._time([self._begin_ns])
            rerun_scene.log_shapes(self._rerun, self._recording, self.scene, at_start)

    def show(self, bag: Bag) -> None:
        """A whole bag, with its arrangement."""
        found = all_series(bag, self._begin_ns)
        self.begin(found[0], self._target(bag, Vehicle.of(self.name, self.scene, []).still_frame))
        self._log(bag, *found)

    def _target(self, bag, frame):
        """Where the vehicle is in the middle of a bag, in the frame that is looked at."""
        if self.scene is None:
            return (0.0, 0.0, 0.0)
        try:
            poses = motion.poses_at(self.scene, motion.tracks(self.scene, bag), [(bag.start_ns + bag.end_ns) // 2],
                                    frame)
        except BagError:  # nothing moves in it; it is said where it is drawn
            return (0.0, 0.0, 0.0)
        return tuple(poses[self.scene.base][0][0]) if self.scene.base in poses else (0.0, 0.0, 0.0)

    def add(self, bag: Bag) -> None:
        """Log all that a bag holds. What cannot be read or drawn is said in ``notes``."""
        self._log(bag, *all_series(bag, self._begin_ns))

    def _log(self, bag, series, problems):
        self._said += [f"not shown: {sentence}" for sentence in problems.values()]
        if self._moving is not None:
            try:
                self._moving.add(bag)
                self._has_moved = True
            except BagError as error:
                self._still = self._still or f"nothing moves in the picture: {error}"
        for one in series:
            self._plot(one)

    def _plot(self, one):
        entity = entity_of(one)
        if entity not in self._titled:
            self._titled.add(entity)
            before = self._lines.get(one.topic, 0)  # of its topic, whose series share plots
            self._lines[one.topic] = before + len(one.lines)
            colours = [_COLOURS[(before + place) % len(_COLOURS)] for place in range(len(one.lines))]
            self._recording.log(entity, self._rerun.SeriesLines(names=one.labels, colors=colours), static=True)
        rows = self._thinned(one.t)
        scalars = self._rerun.Scalars.columns(scalars=one.values[rows].reshape(-1))
        self._recording.send_columns(entity, self._at(one.t[rows]), scalars.partition([len(one.lines)] * len(rows)))

    def _time(self, stamps_ns):
        return self._at((np.asarray(stamps_ns, np.int64) - self._begin_ns) / SECOND)

    def _at(self, seconds):
        return [self._rerun.TimeColumn(TIMELINE, duration=seconds)]

    def _thinned(self, stamps_ns) -> np.ndarray:
        """The rows to show: all of them, or every k-th and the last."""
        count = len(stamps_ns)
        step = max(1, -(-count // self._most))
        if step > 1 and not self._is_thinned:
            self._is_thinned = True
            self._said.append(f"thinned: of topics with more than {self._most} messages, every k-th is shown "
                              "(--points says how many)")
        rows = np.arange(0, count, step)
        return rows if not count or rows[-1] == count - 1 else np.append(rows, count - 1)

    def flush(self, seconds: float = 60.0) -> None:
        """Wait until all has gone out, for so long at most [s]."""
        self._recording.flush(timeout_sec=seconds)

    def close(self, seconds: float = 60.0) -> None:
        """End the recording."""
        with contextlib.suppress(RuntimeError, ValueError):  # a viewer that is gone takes nothing any more
            self.flush(seconds)
        self._recording.disconnect()


def application(scene: Scene | None) -> str:
    """What Rerun keeps a person's own arrangement of views by: the vehicle."""
    return f"flight_graph {scene.name}" if scene is not None else "flight_graph"


def entity_of(series: Series) -> str:
    """Where the numbers of a series are in a recording, as a path."""
    return rerun_scene.joined([PLOTS, *filter(None, series.topic.split("/")), series.name])


def blueprint(rerun, vehicle: Vehicle, target=(0.0, 0.0, 0.0)):
    """The arrangement of a vehicle: picture and overview beside each other, then a tab for each topic.

    target: (3,) the point [m] that is looked at, in the frame that stands still.
    """
    import rerun.blueprint as rrb
    beside = [_view(rrb, plot) for plot in vehicle.overview]
    tabs = [rrb.Vertical(*(_view(rrb, plot) for plot in plots), name=topic) for topic, plots in vehicle.topics.items()]
    first = [] if vehicle.scene is None else [_picture(rerun, rrb, vehicle, target)]
    first += [rrb.Vertical(*beside)] if beside else []
    shares = [3, 2] if len(first) == 2 else None
    return rrb.Blueprint(
        rrb.Tabs(rrb.Horizontal(*first, column_shares=shares, name="overview"), *tabs, active_tab=0),
        rrb.BlueprintPanel(state="collapsed"), rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE, play_state="playing"))


def _picture(rerun, rrb, vehicle, target):
    since = rerun.VisibleTimeRange(TIMELINE, start=rerun.TimeRangeBoundary.infinite(),
                                   end=rerun.TimeRangeBoundary.cursor_relative())
    eye = rrb.EyeControls3D(look_target=target, eye_up=(0.0, 0.0, 1.0),
                            position=np.asarray(target) + vehicle.extent * np.array(_FROM))
    return rrb.Spatial3DView(
        origin=rerun_scene.joined(rerun_scene.path_of(vehicle.scene, vehicle.still_frame)), name=vehicle.scene.name,
        contents=f"+ /{rerun_scene.ROOT}/**", eye_controls=eye,
        overrides={path: rrb.VisibleTimeRanges([since]) for path in rerun_scene.trails(vehicle.scene)})


def blueprint_file(vehicle: Vehicle) -> bytes:
    """The arrangement as a file (.rbl) that Rerun opens beside a recording of such a vehicle."""
    rerun = required("rerun", "view", "flight layout --for rerun")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "vehicle.rbl"
        blueprint(rerun, vehicle).save(application(vehicle.scene), path)
        return path.read_bytes()


def _view(rrb, plot):
    known = scale(plot)
    return rrb.TimeSeriesView(origin="/", contents=[f"+ /{entity_of(one)}" for one in plot.series], name=plot.full_title,
                              axis_y=rrb.ScalarAxis(range=known) if known else None,
                              plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop))


def scale(plot) -> tuple[float, float] | None:
    """The vertical axis of a plot: all that its series hold, and a little more; None where they hold nothing yet."""
    numbers = np.concatenate([line.values for one in plot.series for line in one.lines])
    numbers = numbers[np.isfinite(numbers)]
    if not len(numbers):
        return None
    least, most = float(numbers.min()), float(numbers.max())
    more = MARGIN * (most - least) or 0.5 * abs(most) or 1.0
    return least - more, most + more
