"""The service: one rig over HTTP, for the technician's page and for programs."""
