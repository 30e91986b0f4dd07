"""The way through a plan: visit after visit, past pauses, and anew after interruptions."""

import asyncio
import math
from collections.abc import Sequence

from northfinder.procedures.events import (
    Emit,
    Estimate,
    Paused,
    Phase,
    Progress,
    Resumed,
    SegmentOpened,
    VisitCompleted,
)
from northfinder.procedures.gate import Gate
from northfinder.procedures.measuring import Stop, acquisition_errors, home, measure
from northfinder.procedures.plan import FEWEST_FOR_TARGET
from northfinder.procedures.prediction import Prediction
from northfinder.procedures.proving import Witness, choose_witnesses, require_stillness
from northfinder.procedures.rotation import Keep, Pace, Sector, sweep
from northfinder.procedures.segments import next_segment, planned_visits
from northfinder.procedures.so_far import estimate_so_far
from northfinder.procedures.target import target_reached
from northfinder.procedures.visits import PlannedVisit, Visit, rest_of_passage
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
        self._course = [*prediction.visits, *prediction.reserve]
        self._end_s = [*prediction.end_s, *prediction.reserve_end_s]
        self._emit = emit
        self._gate = gate
        self._began_s = asyncio.get_running_loop().time() - elapsed_s
        self._segment = next_segment(done)
        self._completed = len(planned_visits(done))
        # Of them, until the target is reached.
        self._expected = max(len(prediction.visits), min(self._completed + 1, len(self._course)))
        self._fraction = 0.0

    async def travel(self) -> None:
        """Make every visit of the plan that is not done yet, or those until its target."""
        ended = self._completed >= len(self._course) or self._at_target(self._so_far())
        if not ended:
            await self._open_segment()
        while not ended:
            if await self._paused_for_long():
                await self._open_segment()
            if self._plan.continuous:
                ended = await self._pass()
            else:
                ended = await self._measure(self._course[self._completed])
        self._expected = self._completed
        await self._tell("solving", 0.0)

    async def _measure(self, planned: PlannedVisit) -> bool:
        """Make a visit; say whether it was the last."""
        self._expected = max(self._expected, self._completed + 1)
        await self._tell("measuring", 0.0, planned.angle_rad)
        where = f"visit {planned.index + 1} of {self._expected}"
        await self._visit(planned, planned.dwell_s, None, where)
        return await self._completed_one()

    async def _pass(self) -> bool:
        """Turn through what is left of a passage; say whether it was the last.

        Its gyro feels the table's turning too: each passage is a segment of its own. A pause
        breaks it off after a sector.
        """
        passage = rest_of_passage(self._course, self._completed)
        self._segment = next_segment(self.visits)
        self._expected = max(self._expected, self._completed + len(passage))
        await self._tell("measuring", 0.0, passage[0].angle_rad)
        ended = False

        async def keep(visit: Visit) -> bool:
            nonlocal ended
            await self._keep(visit)
            ended = await self._completed_one()
            await self._tell("measuring", 0.0, visit.angle_rad)
            return self._gate.is_open and not ended

        where = f"the turn {passage[0].direction}, from {passage[0].angle_rad / DEG:g} deg"
        await self._sweep(passage, passage[0].dwell_s, None, where, keep)
        return ended

    async def _completed_one(self) -> bool:
        """Count a visit of the plan, tell what is known; say whether it was the last."""
        self._completed += 1
        so_far = self._so_far() if self._worth_an_estimate() else None
        if so_far is not None:
            self._expect(so_far)
            await self._emit(so_far)
        return self._completed == len(self._course) or self._at_target(so_far)

    def _so_far(self) -> Estimate | None:
        return estimate_so_far(self.visits, self._plan, self._rig.config)

    def _worth_an_estimate(self) -> bool:
        """Solve after every visit, of hundreds after every fiftieth part: the work grows too.

        A run that looks for its target asks after every pair.
        """
        last = self._completed == len(self._course)
        pair = self._plan.ends_at_target and self._completed % self._plan.visits_per_look == 0
        return last or pair or self._completed % max(1, self._completed // 50) == 0

    def _at_target(self, so_far: Estimate | None) -> bool:
        """Say whether the run may end here: it is asked after each pair of visits, or turns."""
        if not self._plan.ends_at_target or self._completed % self._plan.visits_per_look:
            return False
        return target_reached(self.visits, self._plan, self._rig.config, so_far)

    def _expect(self, so_far: Estimate) -> None:
        """Foresee the end of a run that looks for its target: the noise falls with the visits."""
        if self._plan.ends_at_target and self._completed >= FEWEST_FOR_TARGET:
            shares = (so_far.sigma_rad / (self._plan.target_sigma_deg or 1.0) / DEG) ** 2
            step = self._plan.visits_per_look
            looks = math.ceil(self._completed * shares / step)
            self._expected = min(max(step * looks, self._completed + 1), len(self._course))

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
            await self._again(witness)
        if witnesses:
            proof = require_stillness(self.visits, self._segment, self._plan, self._rig.config)
            await self._emit(SegmentOpened(self._segment, proof))

    async def _again(self, witness: Witness) -> None:
        """Measure once more what a witness measured, in the way that it did."""
        where = f"to see that nothing moved, visit {witness.visit.index + 1} again"
        if not self._plan.continuous:
            await self._visit(witness.visit, witness.dwell_s, witness.visit.index, where)
            return

        async def keep(visit: Visit) -> bool:
            await self._keep(visit)
            return True

        repeats = witness.visit.index
        await self._sweep([witness.visit], witness.dwell_s, repeats, where, keep)

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
        await self._keep(await measure(self._rig, stop, self._began_s, where))

    async def _sweep(
        self,
        passage: Sequence[PlannedVisit | Visit],
        dwell_s: float,
        repeats: int | None,
        where: str,
        keep: Keep,
    ) -> None:
        sectors = [
            Sector(len(self.visits) + place, self._segment, at.direction, at.angle_rad, repeats)
            for place, at in enumerate(passage)
        ]
        pace = Pace(2 * math.pi / self._plan.positions, dwell_s, self._plan.settle_s)
        with acquisition_errors(where):
            await sweep(self._rig, sectors, pace, self._began_s, keep)

    async def _keep(self, visit: Visit) -> None:
        self.visits.append(visit)
        await self._emit(VisitCompleted(visit))

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
        if self._completed:
            done_s = self._end_s[self._completed - 1]
        else:
            done_s = 0.0 if phase == "homing" else self._prediction.homing_s
            extra_s = 0.0
        end_s = self._end_s[self._expected - 1]
        # What is expected may grow, but nobody wants to see a run go backwards.
        self._fraction = max(self._fraction, done_s / end_s)
        visit = min(self._completed + 1, self._expected)
        left_s = end_s - done_s + extra_s
        await self._emit(Progress(self._fraction, left_s, phase, visit, self._expected, angle_rad))
