"""gaitopt plans how four-legged robots walk: the fastest statically stable walk over footholds.

>>> import gaitopt
>>> plan = gaitopt.plan_crawl(gaitopt.load_robot("wang2020"), gaitopt.s_columns(seed=0))
>>> gaitopt.replay(plan, "walk.html")

Everything public is named here. Modules are imported when a name is first used, so that
``import gaitopt`` itself is quick.
"""

from __future__ import annotations

from importlib import import_module
from sys import modules
from types import FunctionType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gaitopt.certificate.certificate import Certificate as Certificate
    from gaitopt.certificate.check import Check as Check
    from gaitopt.certificate.check import Verdict as Verdict
    from gaitopt.certificate.verify import verify as verify
    from gaitopt.conventions import LEGS as LEGS
    from gaitopt.dynamics.contact_forces import ContactForces as ContactForces
    from gaitopt.dynamics.contacts import ForceLimits as ForceLimits
    from gaitopt.dynamics.feasible_region import feasible_region as feasible_region
    from gaitopt.entering.feet_down import FeetDown as FeetDown
    from gaitopt.entering.feet_down import feet_down as feet_down
    from gaitopt.entering.nearest import NearestState as NearestState
    from gaitopt.entering.nearest import nearest_state as nearest_state
    from gaitopt.entering.standing_up import plan_stand_up as plan_stand_up
    from gaitopt.entering.standing_up import square_stance as square_stance
    from gaitopt.errors import CertificateError as CertificateError
    from gaitopt.errors import FootholdsError as FootholdsError
    from gaitopt.errors import FootholdsWarning as FootholdsWarning
    from gaitopt.errors import GaitoptError as GaitoptError
    from gaitopt.errors import GroundError as GroundError
    from gaitopt.errors import InfeasibleSpeedError as InfeasibleSpeedError
    from gaitopt.errors import InfeasibleStateError as InfeasibleStateError
    from gaitopt.errors import InfeasibleStepError as InfeasibleStepError
    from gaitopt.errors import InputError as InputError
    from gaitopt.errors import MissingPackageError as MissingPackageError
    from gaitopt.errors import PlanFileError as PlanFileError
    from gaitopt.errors import RobotError as RobotError
    from gaitopt.errors import RobotWarning as RobotWarning
    from gaitopt.errors import RouteError as RouteError
    from gaitopt.errors import SingularLegError as SingularLegError
    from gaitopt.errors import SolverError as SolverError
    from gaitopt.errors import StudyError as StudyError
    from gaitopt.errors import StudyWarning as StudyWarning
    from gaitopt.errors import TerrainError as TerrainError
    from gaitopt.errors import UnknownNameError as UnknownNameError
    from gaitopt.errors import UnsolvedSplineError as UnsolvedSplineError
    from gaitopt.exporting.export import export as export
    from gaitopt.exporting.export import export_ros as export_ros
    from gaitopt.exporting.sampled import Exported as Exported
    from gaitopt.exporting.tables import export_csv as export_csv
    from gaitopt.gait.gaits import bound as bound
    from gaitopt.gait.gaits import pace as pace
    from gaitopt.gait.gaits import pronk as pronk
    from gaitopt.gait.gaits import quasi_static as quasi_static
    from gaitopt.gait.gaits import trot as trot
    from gaitopt.gait.gaits import walk as walk
    from gaitopt.gait.gaits import wave as wave
    from gaitopt.gait.longitudinal import longitudinal_margin as longitudinal_margin
    from gaitopt.gait.longitudinal import margin_over_duty as margin_over_duty
    from gaitopt.gait.schedule import GaitSchedule as GaitSchedule
    from gaitopt.gait.state_machine import GaitStateMachine as GaitStateMachine
    from gaitopt.gait.state_machine import LegState as LegState
    from gaitopt.gait.step_timing import SwingEvent as SwingEvent
    from gaitopt.gait.step_timing import adapted_step_time as adapted_step_time
    from gaitopt.gait.step_timing import swing_events as swing_events
    from gaitopt.motion.path import MotionPath as MotionPath
    from gaitopt.optimize.cog.solver import CogProblem as CogProblem
    from gaitopt.optimize.cog.solver import CogSolution as CogSolution
    from gaitopt.optimize.cog.solver import build_cog_problem as build_cog_problem
    from gaitopt.optimize.cog.solver import solve_cog as solve_cog
    from gaitopt.optimize.posture.solver import solve_posture as solve_posture
    from gaitopt.optimize.speed import build_speed_lp as build_speed_lp
    from gaitopt.optimize.speed import solve_speed_lp as solve_speed_lp
    from gaitopt.optimize.spline.joint_spline import JointSpline as JointSpline
    from gaitopt.optimize.spline.solver import solve_spline as solve_spline
    from gaitopt.plan.com_margin import com_margin as com_margin
    from gaitopt.plan.contact_forces import contact_forces as contact_forces
    from gaitopt.plan.phase import Phase as Phase
    from gaitopt.plan.plan import Plan as Plan
    from gaitopt.plan.plan_file import load_plan as load_plan
    from gaitopt.plan.record import CrawlRecord as CrawlRecord
    from gaitopt.plan.record import GaitRecord as GaitRecord
    from gaitopt.plan.record import PlanRecord as PlanRecord
    from gaitopt.plan.record import RouteRecord as RouteRecord
    from gaitopt.plan.record import StrideRecord as StrideRecord
    from gaitopt.plan.settings.base import PlanSettings as PlanSettings
    from gaitopt.plan.settings.by_velocity import GaitSettings as GaitSettings
    from gaitopt.plan.settings.crawl import CrawlSettings as CrawlSettings
    from gaitopt.plan.settings.freedoms import Freedoms as Freedoms
    from gaitopt.plan.settings.over_obstacle import StrideSettings as StrideSettings
    from gaitopt.plan.settings.time_optimal import RouteSettings as RouteSettings
    from gaitopt.plan.state import State as State
    from gaitopt.plan.swings import Swing as Swing
    from gaitopt.plan.trajectory import Trajectory as Trajectory
    from gaitopt.planners.by_velocity.planner import plan_gait as plan_gait
    from gaitopt.planners.crawl import plan_crawl as plan_crawl
    from gaitopt.planners.over_obstacle.planner import plan_stride as plan_stride
    from gaitopt.planners.over_terrain.planner import choose_footholds as choose_footholds
    from gaitopt.planners.over_terrain.planner import plan_terrain as plan_terrain
    from gaitopt.planners.over_terrain.planner import search_terrain as search_terrain
    from gaitopt.planners.over_terrain.result import TerrainSearch as TerrainSearch
    from gaitopt.planners.over_terrain.settings import TerrainSettings as TerrainSettings
    from gaitopt.planners.time_optimal.planner import plan_route as plan_route
    from gaitopt.retiming.retimed import retimed as retimed
    from gaitopt.robots.catalog import load_robot as load_robot
    from gaitopt.robots.catalog import robot_names as robot_names
    from gaitopt.robots.configurations import file_configurations as file_configurations
    from gaitopt.robots.leg import Leg as Leg
    from gaitopt.robots.quadruped import Quadruped as Quadruped
    from gaitopt.robots.whole_body import feet_from_joints as feet_from_joints
    from gaitopt.robots.whole_body import joints_from_feet as joints_from_feet
    from gaitopt.simulation.result import SimulationResult as SimulationResult
    from gaitopt.simulation.result import SimulationStatus as SimulationStatus
    from gaitopt.simulation.settings import Push as Push
    from gaitopt.simulation.settings import SimulationSettings as SimulationSettings
    from gaitopt.simulation.simulate import simulate as simulate
    from gaitopt.stability.contacts import support_margin as support_margin
    from gaitopt.stability.margins import static_stability_margin as static_stability_margin
    from gaitopt.stability.support import shrunken_polygon as shrunken_polygon
    from gaitopt.stability.zmp import whole_body_zmp as whole_body_zmp
    from gaitopt.studies.compare import Comparison as Comparison
    from gaitopt.studies.compare import compare as compare
    from gaitopt.studies.explore import explore as explore
    from gaitopt.swing.catalogue import SWING_CURVES as SWING_CURVES
    from gaitopt.swing.catalogue import swing_curve as swing_curve
    from gaitopt.swing.curve import SwingCurve as SwingCurve
    from gaitopt.swing.touchdown import com_touchdown as com_touchdown
    from gaitopt.swing.touchdown import velocity_touchdown as velocity_touchdown
    from gaitopt.terrain.ball_contact import BallContact as BallContact
    from gaitopt.terrain.columns import s_columns as s_columns
    from gaitopt.terrain.footholds import Footholds as Footholds
    from gaitopt.terrain.ground_files.load import load_ground as load_ground
    from gaitopt.terrain.height_map import HeightMap as HeightMap
    from gaitopt.terrain.layers import Footing as Footing
    from gaitopt.terrain.layers import GroundLayers as GroundLayers
    from gaitopt.terrain.layers import ground_layers as ground_layers
    from gaitopt.terrain.maps.catalogue import ground_names as ground_names
    from gaitopt.terrain.maps.catalogue import make_ground as make_ground
    from gaitopt.terrain.obstacles import Obstacle as Obstacle
    from gaitopt.terrain.obstacles import rectangular_obstacle as rectangular_obstacle
    from gaitopt.terrain.obstacles import round_obstacle as round_obstacle
    from gaitopt.terrain.obstacles import triangular_obstacle as triangular_obstacle
    from gaitopt.viewing.figures.crawl_figures import save_figures as save_figures
    from gaitopt.viewing.figures.feasible_area import plot_feasible_area as plot_feasible_area
    from gaitopt.viewing.figures.gait_cycle import plot_gait_cycle as plot_gait_cycle
    from gaitopt.viewing.figures.gait_cycle import plot_swing as plot_swing
    from gaitopt.viewing.figures.gait_figures import save_gait_figures as save_gait_figures
    from gaitopt.viewing.figures.joint_curves import plot_joint_curves as plot_joint_curves
    from gaitopt.viewing.figures.margin import plot_margin as plot_margin
    from gaitopt.viewing.figures.over_time import plot_cog_over_time as plot_cog_over_time
    from gaitopt.viewing.figures.over_time import plot_joint_velocities as plot_joint_velocities
    from gaitopt.viewing.figures.paths import plot_paths as plot_paths
    from gaitopt.viewing.figures.paths import plot_terrain as plot_terrain
    from gaitopt.viewing.figures.posture import plot_posture as plot_posture
    from gaitopt.viewing.figures.race import plot_race as plot_race
    from gaitopt.viewing.figures.schedule import plot_gait_diagram as plot_gait_diagram
    from gaitopt.viewing.figures.schedule import plot_margin_over_duty as plot_margin_over_duty
    from gaitopt.viewing.figures.snapshots import plot_snapshots as plot_snapshots
    from gaitopt.viewing.figures.snapshots import plot_stride_snapshots as plot_stride_snapshots
    from gaitopt.viewing.figures.swing_curves import plot_cycloids as plot_cycloids
    from gaitopt.viewing.figures.swing_curves import plot_swing_curves as plot_swing_curves
    from gaitopt.viewing.figures.terrain_map import plot_terrain_map as plot_terrain_map
    from gaitopt.viewing.figures.terrain_profile import plot_terrain_profile as plot_terrain_profile
    from gaitopt.viewing.figures.zmp import plot_zmp as plot_zmp
    from gaitopt.viewing.notebook.progress import progress_bar as progress_bar
    from gaitopt.viewing.replay.browser import view as view
    from gaitopt.viewing.replay.replay import replay as replay
    from gaitopt.viewing.replay.replay import show as show
    from gaitopt.viewing.replay.video.video import replay_video as replay_video

__version__ = "0.1.0"

_HOMES = {
    "certificate.certificate": "Certificate",
    "certificate.check": "Check Verdict",
    "certificate.verify": "verify",
    "conventions": "LEGS",
    "dynamics.contact_forces": "ContactForces",
    "dynamics.contacts": "ForceLimits",
    "dynamics.feasible_region": "feasible_region",
    "entering.feet_down": "FeetDown feet_down",
    "entering.nearest": "NearestState nearest_state",
    "entering.standing_up": "plan_stand_up square_stance",
    "errors": (
        "CertificateError FootholdsError FootholdsWarning GaitoptError GroundError "
        "InfeasibleSpeedError InfeasibleStateError InfeasibleStepError "
        "InputError MissingPackageError PlanFileError RobotError RobotWarning RouteError "
        "SingularLegError SolverError StudyError StudyWarning TerrainError "
        "UnknownNameError UnsolvedSplineError"
    ),
    "exporting.export": "export export_ros",
    "exporting.sampled": "Exported",
    "exporting.tables": "export_csv",
    "gait.gaits": "bound pace pronk quasi_static trot walk wave",
    "gait.longitudinal": "longitudinal_margin margin_over_duty",
    "gait.schedule": "GaitSchedule",
    "gait.state_machine": "GaitStateMachine LegState",
    "gait.step_timing": "SwingEvent adapted_step_time swing_events",
    "motion.path": "MotionPath",
    "optimize.cog.solver": "CogProblem CogSolution build_cog_problem solve_cog",
    "optimize.posture.solver": "solve_posture",
    "optimize.speed": "build_speed_lp solve_speed_lp",
    "optimize.spline.joint_spline": "JointSpline",
    "optimize.spline.solver": "solve_spline",
    "plan.com_margin": "com_margin",
    "plan.contact_forces": "contact_forces",
    "plan.phase": "Phase",
    "plan.plan": "Plan",
    "plan.plan_file": "load_plan",
    "plan.record": "CrawlRecord GaitRecord PlanRecord RouteRecord StrideRecord",
    "plan.settings.freedoms": "Freedoms",
    "plan.settings.base": "PlanSettings",
    "plan.settings.by_velocity": "GaitSettings",
    "plan.settings.crawl": "CrawlSettings",
    "plan.settings.over_obstacle": "StrideSettings",
    "plan.settings.time_optimal": "RouteSettings",
    "plan.state": "State",
    "plan.swings": "Swing",
    "plan.trajectory": "Trajectory",
    "planners.by_velocity.planner": "plan_gait",
    "planners.crawl": "plan_crawl",
    "planners.over_obstacle.planner": "plan_stride",
    "planners.over_terrain.planner": "choose_footholds plan_terrain search_terrain",
    "planners.over_terrain.result": "TerrainSearch",
    "planners.over_terrain.settings": "TerrainSettings",
    "planners.time_optimal.planner": "plan_route",
    "retiming.retimed": "retimed",
    "robots.catalog": "load_robot robot_names",
    "robots.configurations": "file_configurations",
    "robots.leg": "Leg",
    "robots.quadruped": "Quadruped",
    "robots.whole_body": "feet_from_joints joints_from_feet",
    "simulation.result": "SimulationResult SimulationStatus",
    "simulation.settings": "Push SimulationSettings",
    "simulation.simulate": "simulate",
    "stability.contacts": "support_margin",
    "stability.margins": "static_stability_margin",
    "stability.support": "shrunken_polygon",
    "stability.zmp": "whole_body_zmp",
    "studies.compare": "Comparison compare",
    "studies.explore": "explore",
    "swing.catalogue": "SWING_CURVES swing_curve",
    "swing.curve": "SwingCurve",
    "swing.touchdown": "com_touchdown velocity_touchdown",
    "terrain.ball_contact": "BallContact",
    "terrain.columns": "s_columns",
    "terrain.footholds": "Footholds",
    "terrain.ground_files.load": "load_ground",
    "terrain.height_map": "HeightMap",
    "terrain.layers": "Footing GroundLayers ground_layers",
    "terrain.maps.catalogue": "ground_names make_ground",
    "terrain.obstacles": "Obstacle rectangular_obstacle round_obstacle triangular_obstacle",
    "viewing.figures.crawl_figures": "save_figures",
    "viewing.figures.feasible_area": "plot_feasible_area",
    "viewing.figures.gait_cycle": "plot_gait_cycle plot_swing",
    "viewing.figures.gait_figures": "save_gait_figures",
    "viewing.figures.joint_curves": "plot_joint_curves",
    "viewing.figures.margin": "plot_margin",
    "viewing.figures.over_time": "plot_cog_over_time plot_joint_velocities",
    "viewing.figures.paths": "plot_paths plot_terrain",
    "viewing.figures.posture": "plot_posture",
    "viewing.figures.race": "plot_race",
    "viewing.figures.schedule": "plot_gait_diagram plot_margin_over_duty",
    "viewing.figures.snapshots": "plot_snapshots plot_stride_snapshots",
    "viewing.figures.swing_curves": "plot_cycloids plot_swing_curves",
    "viewing.figures.terrain_map": "plot_terrain_map",
    "viewing.figures.terrain_profile": "plot_terrain_profile",
    "viewing.figures.zmp": "plot_zmp",
    "viewing.notebook.progress": "progress_bar",
    "viewing.replay.browser": "view",
    "viewing.replay.replay": "replay show",
    "viewing.replay.video.video": "replay_video",
}
_EXPORTS = {name: home for home, names in _HOMES.items() for name in names.split()}

__all__ = ["__version__", *sorted(_EXPORTS)]


def __getattr__(name: str) -> Any:
    if name not in _EXPORTS:
        raise AttributeError(f"module 'gaitopt' has no attribute {name!r}")
    value = getattr(import_module(f"gaitopt.{_EXPORTS[name]}"), name)
    if isinstance(value, FunctionType):
        value = import_module("gaitopt.arguments").checked(value, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


def _in_notebooks() -> None:
    """In IPython, show plans, robots, footholds and ground as pictures with a few lines."""
    ipython = modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    if shell is not None:
        import_module("gaitopt.viewing.notebook.register").register(shell)


_in_notebooks()
