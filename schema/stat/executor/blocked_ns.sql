-- description: How much time callbacks that exclude others kept them from starting up to a moment.
--     `run` is the last such callback that began by then; while it runs, the time in which the
--     executor is busy (up to the moment in all: `busy_ns`) is not part of it.
CREATE OR REPLACE MACRO derive.blocked_ns(run, at_ns, busy_ns) AS
CASE
    WHEN run.end_ns IS NULL THEN 0
    WHEN at_ns >= run.end_ns THEN run.before_ns + run.blocked_ns
    ELSE run.before_ns + at_ns - run.start_ns - (busy_ns - run.start_busy_ns)
END
