-- description: How much time callbacks that exclude others kept them from starting up to a moment.
--     `callback` is the last such callback that began by then; while it runs, the time in which the
--     executor is busy (up to the moment in all: `busy_ns`) is not part of it.
CREATE OR REPLACE MACRO derive.blocked_ns(callback, at_ns, busy_ns) AS
CASE
    WHEN callback.end_ns IS NULL THEN 0
    WHEN at_ns >= callback.end_ns THEN callback.before_ns + callback.blocked_ns
    ELSE callback.before_ns + at_ns - callback.start_ns - (busy_ns - callback.start_busy_ns)
END
