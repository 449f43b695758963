"""Every study that `groundstation reproduce` knows: our own, and those of installed packages."""

from __future__ import annotations

from importlib.metadata import entry_points

from groundstation.declarations.errors import UsageError
from groundstation.studies.air_table.study import AIR_TABLE
from groundstation.studies.chibis.study import CHIBIS
from groundstation.studies.evolution.study import DIFFERENTIAL_EVOLUTION
from groundstation.studies.study import Study

GROUP = "groundstation.studies"
OWN: tuple[Study, ...] = (AIR_TABLE, CHIBIS, DIFFERENTIAL_EVOLUTION)


def studies() -> dict[str, Study]:
    """Return all studies by name.

    Raises:
        UsageError: What an installed package offers cannot be loaded, is no study, or bears a name twice.
    """
    found = {study.name: study for study in OWN}
    for point in sorted(entry_points(group=GROUP), key=lambda point: point.name):
        where = f"the study {point.name!r} ({point.value})"
        try:
            study = point.load()
        except (Exception, SystemExit) as error:  # whatever somebody's package raises while it is imported
            raise UsageError(f"{where} cannot be loaded ({type(error).__name__}: {error}).") from error
        if not isinstance(study, Study):
            raise UsageError(f"{where} is no Study of groundstation.studies.study.")
        if study.name in found:
            raise UsageError(f"{where}: there is another study {study.name!r}.")
        found[study.name] = study
    return found
