-- description: PID namespaces for processes whose events have none. If the sessions of a host are
--     of several containers, each container but the first gets a number. Else, if several processes
--     ran under one pid at the same time, each of their names gets one. These numbers are negative,
--     so that they differ from all that were recorded. Else the namespace counts that another
--     session recorded for the pid.
-- grain: one row per session, pid and name of a thread
-- column: session BIGINT  The session
-- column: vpid INTEGER  The pid
-- column: procname VARCHAR  Name of the thread
-- column: namespace BIGINT  Its PID namespace
-- when: temp.alternating_name, temp.process_namespace, temp.session_container
WITH named AS (
    SELECT DISTINCT s.host, r.vpid, n.procname
    FROM raw.thread_name AS n
    JOIN raw.thread AS r ON n.thread_index = r.thread_index
    JOIN session_trace AS s ON r.trace_index = s.trace_index
    WHERE r.pid_ns IS NULL AND r.vpid >= 0
),
session AS (
    SELECT
        s.host, s.session, c.container,
        count(c.container) OVER (PARTITION BY s.host) > 0 AS has_containers
    FROM (SELECT DISTINCT host, session FROM session_trace) AS s
    LEFT JOIN session_container AS c ON s.session = c.session
),
given AS (
    SELECT
        s.session, n.vpid, n.procname,
        CASE
            WHEN s.has_containers THEN -s.container
            WHEN a.procname IS NOT NULL
                THEN -dense_rank() OVER (PARTITION BY n.host ORDER BY a.procname)
            ELSE p.pid_ns
        END AS namespace
    FROM session AS s
    JOIN named AS n ON s.host = n.host
    LEFT JOIN alternating_name AS a
        ON n.host = a.host AND n.vpid = a.vpid AND n.procname = a.procname
    LEFT JOIN process_namespace AS p ON n.host = p.host AND n.vpid = p.vpid
)
SELECT session, vpid, procname, namespace FROM given WHERE namespace IS NOT NULL
