"""The way through a plan: visit after visit, past pauses, and anew after interruptions."""

import asyncio
from collections.abc import Sequence

from northfinder.procedures.events import (
    Emit,
    Paused,
    Phase,
    Progress,
    Resumed,
    SegmentOpened,
    VisitCompleted,
)
from northfinder.procedures.gate import Gate
from northfinder.procedures.measuring import Stop, home, measure
from northfinder.procedures.planning import Prediction
from northfinder.procedures.proving import Witness, choose_witnesses, require_stillness
from northfinder.procedures.segments import next_segment, planned_visits
from northfinder.procedures.so_far import estimate_so_far
from northfinder.procedures.visits import PlannedVisit, Visit
from northfinder.rig import Rig
from northfinder.units import DEG


class Journey:
    """One life of a run.

    Attributes:
        visits: All visits so far, of earlier lives too, in time order.

    Args:
        rig: The open rig.
        prediction: The plan, its visits and their times.
        emit: Awaited for every event.
        done: The visits of earlier lives.
        elapsed_s: From the start of the run to now.
        gate: Where to wait while the run is paused.
    """

    def __init__(  # noqa: PLR0913, PLR0917 -- see north_seek.run
        self,
        rig: Rig,
        prediction: Prediction,
        emit: Emit,
        done: Sequence[Visit],
        elapsed_s: float,
        gate: Gate,
    ) -> None:
        self.visits = list(done)
        self._rig = rig
        self._prediction = prediction
        self._plan = prediction.plan
        self._emit = emit
        self._gate = gate
        self._began_s = asyncio.get_running_loop().time() - elapsed_s
        self._segment = next_segment(done)
        self._completed = len(planned_visits(done))

    async def travel(self) -> None:
        """Make every visit of the plan that is not done yet."""
        remaining = self._prediction.visits[self._completed :]
        if remaining:
            await self._open_segment()
        for planned in remaining:
            if await self._paused_for_long():
                await self._open_segment()
            await self._measure(planned)
        await self._tell("solving", 0.0)

    async def _measure(self, planned: PlannedVisit) -> None:
        await self._tell("measuring", 0.0, planned.angle_rad)
        where = f"visit {planned.index + 1} of {len(self._prediction.visits)}"
        await self._visit(planned, planned.dwell_s, None, where)
        self._completed += 1
        if self._worth_an_estimate():
            so_far = estimate_so_far(self.visits, self._plan, self._rig.config)
            if so_far is not None:
                await self._emit(so_far)

    def _worth_an_estimate(self) -> bool:
        """Solve after every visit, of hundreds after every fiftieth part: the work grows too."""
        last = self._completed == len(self._prediction.visits)
        return last or self._completed % max(1, self._completed // 50) == 0

    async def _open_segment(self) -> None:
        """Home; where there are earlier visits, go on only when the bench has not moved since."""
        witnesses = choose_witnesses(self.visits, self._plan, self._rig.config)
        proof_s = [self._duration_s(witness) for witness in witnesses]
        self._segment = next_segment(self.visits)
        await self._tell("homing", self._prediction.homing_s + sum(proof_s))
        await home(self._rig, anew=bool(witnesses))
        for place, witness in enumerate(witnesses):
            if await self._paused_for_long():
                await self._open_segment()
                return
            await self._tell("proving", sum(proof_s[place:]), witness.visit.angle_rad)
            where = f"to see that nothing moved, visit {witness.visit.index + 1} again"
            await self._visit(witness.visit, witness.dwell_s, witness.visit.index, where)
        if witnesses:
            proof = require_stillness(self.visits, self._segment, self._plan, self._rig.config)
            await self._emit(SegmentOpened(self._segment, proof))

    async def _visit(
        self, at: PlannedVisit | Visit, dwell_s: float, repeats: int | None, where: str
    ) -> None:
        stop = Stop(
            index=len(self.visits),
            segment=self._segment,
            direction=at.direction,
            angle_rad=at.angle_rad,
            dwell_s=dwell_s,
            settle_s=self._plan.settle_s,
            repeats=repeats,
        )
        where = f"{where}, at {at.angle_rad / DEG:g} deg"
        self.visits.append(await measure(self._rig, stop, self._began_s, where))
        await self._emit(VisitCompleted(self.visits[-1]))

    async def _paused_for_long(self) -> bool:
        """Wait at the gate; say whether that took longer than a dwell, with visits to lose."""
        if self._gate.is_open:
            return False
        loop = asyncio.get_running_loop()
        began_s = loop.time()
        await self._emit(Paused())
        await self._gate.wait_until_open()
        paused_s = loop.time() - began_s
        await self._emit(Resumed(paused_s))
        return paused_s > self._plan.dwell_s and bool(self.visits)

    def _duration_s(self, witness: Witness) -> float:
        """Return about how long a visit takes, moving included."""
        prediction = self._prediction
        mean_s = (prediction.duration_s - prediction.homing_s) / len(prediction.visits)
        return mean_s - prediction.visits[0].dwell_s + witness.dwell_s

    async def _tell(self, phase: Phase, extra_s: float, angle_rad: float | None = None) -> None:
        """Tell how far the plan is; ``extra_s`` is what must come before it goes on."""
        prediction, visits = self._prediction, len(self._prediction.visits)
        if self._completed:
            done_s = prediction.end_s[self._completed - 1]
        else:
            done_s = 0.0 if phase == "homing" else prediction.homing_s
            extra_s = 0.0
        left_s = prediction.duration_s - done_s + extra_s
        visit = min(self._completed + 1, visits)
        fraction = done_s / prediction.duration_s
        await self._emit(Progress(fraction, left_s, phase, visit, visits, angle_rad))
