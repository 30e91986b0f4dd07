"""A study as JSON, for programs and for the web page."""

from typing import Any

from northfinder.software import version
from northfinder.studies.chart import Chart
from northfinder.studies.claim import Claim, Quantity
from northfinder.studies.study import Cell, Study, Table


def study_json(study: Study) -> dict[str, Any]:
    """Return all of a study but the drawings themselves; every figure in full and as written."""
    return {
        "kind": "study",
        "name": study.name,
        "title": study.title,
        "paper": study.paper,
        "summary": study.summary,
        "conditions": study.conditions,
        "claims": [_claim(claim, study.command) for claim in study.claims],
        "tables": [_table(table) for table in study.tables],
        "figures": [_chart(chart) for chart in study.charts],
        "software": {"version": version()},
    }


def _claim(claim: Claim, command: str) -> dict[str, Any]:
    return {
        "where": claim.where,
        "says": claim.says,
        "conditions": claim.conditions,
        "printed": None if claim.printed is None else _quantity(claim.printed),
        "ours": _quantity(claim.ours),
        "verdict": claim.verdict.value,
        "reason": claim.reason,
        "command": command,
    }


def _quantity(quantity: Quantity) -> dict[str, Any]:
    return {"value": float(quantity.value), "unit": quantity.unit, "text": str(quantity)}


def _table(table: Table) -> dict[str, Any]:
    return {
        "title": table.title,
        "columns": list(table.columns),
        "rows": [[_cell(cell) for cell in row] for row in table.rows],
        "repeatable": table.repeatable,
    }


def _cell(cell: Cell) -> Any:  # noqa: ANN401 (JSON)
    return _quantity(cell) if isinstance(cell, Quantity) else cell


def _chart(chart: Chart) -> dict[str, str]:
    return {"name": chart.name, "title": chart.title, "description": chart.description}
