-- title: Goals that never end
-- description: The server accepted them and the client asked for their results, but the server sent
--     none until the end of the recording, in ten times as long as any other goal of it took. Goals
--     that came later have ended.
-- cause: Its callback does not execute the goal (handle_accepted_callback did not call execute, or
--     a worker has dropped it), waits for something that never comes, or does not call succeed,
--     abort or canceled.
-- cure: Execute each goal that is accepted, or abort it; give the client a limit for its waiting.
-- next: query action-latency
-- grain: one row per action server
-- severity: warning
-- when: store.service WHERE ends_with(service_name, '/_action/send_goal')
WITH ended AS (
    SELECT
        action_server_id,
        max(execution_ns) AS longest_ns,
        max(sent_ns) FILTER (WHERE result_sent_ns IS NOT NULL) AS last_ns
    FROM main.goal
    GROUP BY action_server_id
)
SELECT
    g.run_id,
    o.node_id,
    main.node_label(n.full_name, p.name, p.pid) AS subject,
    count(*) FILTER (
        WHERE g.result_sent_ns IS NULL
            AND g.result_candidate_count = 1
            AND g.cancel_accepted_ns IS NULL
            AND NOT g.is_loss_affected
            AND g.sent_ns < e.last_ns
            AND r.end_ns - g.answered_ns > 10 * e.longest_ns
    ) AS count,
    printf(
        '%d of %d goals of %s were accepted and have no result; others take %s at most',
        count, count(*), any_value(g.action_name), main.duration_text(any_value(e.longest_ns))
    ) AS detail
FROM main.goal AS g
JOIN ended AS e ON g.action_server_id = e.action_server_id
JOIN main.run AS r ON g.run_id = r.run_id
JOIN main.action_server AS o ON g.action_server_id = o.action_server_id
JOIN main.process AS p ON o.process_id = p.process_id
LEFT JOIN main.node AS n ON o.node_id = n.node_id
WHERE g.is_accepted
GROUP BY g.run_id, o.node_id, g.action_server_id, n.full_name, p.name, p.pid
HAVING count > 0
