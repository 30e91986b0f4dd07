"""What is handed on of a run: figures and the certificate, the page's printed sibling.

Both read what is recorded (the JSON of REST and of ``--json``), never an object of a running
measurement: so a record of years ago renders like one of today.
"""
