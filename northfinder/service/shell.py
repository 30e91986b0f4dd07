"""Everything that stands before the routes, in the order in which a request meets it."""

from collections.abc import Collection

from starlette.middleware import Middleware

from northfinder.service.body_limit import BodyLimit
from northfinder.service.last_resort import LastResort
from northfinder.service.logs import AccessLog
from northfinder.service.metrics import CountedRequests, Metrics
from northfinder.service.origins import CrossOriginCheck, HostCheck
from northfinder.service.policies import SecurityHeaders
from northfinder.service.sessions import Guesses, Sessions
from northfinder.service.settings import ServiceSettings
from northfinder.service.token_check import TokenCheck


def shell(
    settings: ServiceSettings,
    metrics: Metrics,
    sessions: Sessions,
    guesses: Guesses | None,
    public_paths: Collection[str],
) -> list[Middleware]:
    """Return the middleware of an application, the outermost first.

    Args:
        settings: For whom the service is.
        metrics: What counts the requests.
        sessions: The browsers that have shown the token.
        guesses: What checks it; None where the service needs none.
        public_paths: What is read without it: the page's files and ``/healthz``.
    """
    layers = [
        Middleware(AccessLog),
        Middleware(CountedRequests, metrics),
        Middleware(SecurityHeaders),
        Middleware(LastResort),
        Middleware(HostCheck, settings.allowed_hosts),
        Middleware(CrossOriginCheck),
    ]
    if guesses is not None:
        layers.append(Middleware(TokenCheck, sessions, guesses, public_paths))
    return [*layers, Middleware(BodyLimit)]
