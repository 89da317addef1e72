"""gaitopt plans how four-legged robots walk: the fastest statically stable walk over footholds.

>>> import gaitopt
>>> plan = gaitopt.plan_crawl(gaitopt.load_robot("wang2020"), gaitopt.s_columns(seed=0))
>>> gaitopt.replay(plan, "walk.html")

Everything public is named here. Modules are imported when a name is first used, so that
``import gaitopt`` itself is quick.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gaitopt.checking.balance import com_margin as com_margin
    from gaitopt.checking.certificate import Certificate as Certificate
    from gaitopt.checking.certificate import CertificateError as CertificateError
    from gaitopt.checking.certificate import Check as Check
    from gaitopt.checking.certificate import verify as verify
    from gaitopt.checking.sim_result import SimulationResult as SimulationResult
    from gaitopt.checking.sim_settings import Push as Push
    from gaitopt.checking.sim_settings import SimulationSettings as SimulationSettings
    from gaitopt.checking.simulation import simulate as simulate
    from gaitopt.conventions import LEGS as LEGS
    from gaitopt.errors import FootholdsError as FootholdsError
    from gaitopt.errors import GaitoptError as GaitoptError
    from gaitopt.errors import InfeasibleStepError as InfeasibleStepError
    from gaitopt.errors import InputError as InputError
    from gaitopt.errors import MissingPackageError as MissingPackageError
    from gaitopt.errors import PlanFileError as PlanFileError
    from gaitopt.errors import RobotError as RobotError
    from gaitopt.errors import SolverError as SolverError
    from gaitopt.exporting.ros import export_ros as export_ros
    from gaitopt.exporting.tables import export_csv as export_csv
    from gaitopt.optimize.cog import CogProblem as CogProblem
    from gaitopt.optimize.cog import CogSolution as CogSolution
    from gaitopt.optimize.cog import build_cog_problem as build_cog_problem
    from gaitopt.optimize.cog import solve_cog as solve_cog
    from gaitopt.optimize.speed import build_speed_lp as build_speed_lp
    from gaitopt.optimize.speed import solve_speed_lp as solve_speed_lp
    from gaitopt.planning.crawl import plan_crawl as plan_crawl
    from gaitopt.planning.path import MotionPath as MotionPath
    from gaitopt.planning.phase import Phase as Phase
    from gaitopt.planning.phase import Swing as Swing
    from gaitopt.planning.plan import Plan as Plan
    from gaitopt.planning.plan import Trajectory as Trajectory
    from gaitopt.planning.settings import CrawlSettings as CrawlSettings
    from gaitopt.planning.settings import PlanSettings as PlanSettings
    from gaitopt.planning.storage import load_plan as load_plan
    from gaitopt.robots.catalog import load_robot as load_robot
    from gaitopt.robots.catalog import robot_names as robot_names
    from gaitopt.robots.leg import Leg as Leg
    from gaitopt.robots.quadruped import Quadruped as Quadruped
    from gaitopt.stability.margins import static_stability_margin as static_stability_margin
    from gaitopt.stability.support import shrunken_polygon as shrunken_polygon
    from gaitopt.studies.compare import Comparison as Comparison
    from gaitopt.studies.compare import compare as compare
    from gaitopt.terrain.columns import s_columns as s_columns
    from gaitopt.terrain.footholds import Footholds as Footholds
    from gaitopt.viewing.live import view as view
    from gaitopt.viewing.plots import save_figures as save_figures
    from gaitopt.viewing.replay import replay as replay
    from gaitopt.viewing.replay import show as show

__version__ = "0.1.0"

_HOMES = {
    "checking.balance": "com_margin",
    "checking.certificate": "Certificate CertificateError Check verify",
    "checking.sim_result": "SimulationResult",
    "checking.sim_settings": "Push SimulationSettings",
    "checking.simulation": "simulate",
    "conventions": "LEGS",
    "errors": "FootholdsError GaitoptError InfeasibleStepError InputError MissingPackageError "
    "PlanFileError RobotError SolverError",
    "exporting.ros": "export_ros",
    "exporting.tables": "export_csv",
    "optimize.cog": "CogProblem CogSolution build_cog_problem solve_cog",
    "optimize.speed": "build_speed_lp solve_speed_lp",
    "planning.crawl": "plan_crawl",
    "planning.path": "MotionPath",
    "planning.phase": "Phase Swing",
    "planning.plan": "Plan Trajectory",
    "planning.settings": "CrawlSettings PlanSettings",
    "planning.storage": "load_plan",
    "robots.catalog": "load_robot robot_names",
    "robots.leg": "Leg",
    "robots.quadruped": "Quadruped",
    "stability.margins": "static_stability_margin",
    "stability.support": "shrunken_polygon",
    "studies.compare": "Comparison compare",
    "terrain.columns": "s_columns",
    "terrain.footholds": "Footholds",
    "viewing.live": "view",
    "viewing.plots": "save_figures",
    "viewing.replay": "replay show",
}
_EXPORTS = {name: home for home, names in _HOMES.items() for name in names.split()}

__all__ = ["__version__", *sorted(_EXPORTS)]


def __getattr__(name: str) -> Any:
    if name not in _EXPORTS:
        raise AttributeError(f"module 'gaitopt' has no attribute {name!r}")
    value = getattr(import_module(f"gaitopt.{_EXPORTS[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
