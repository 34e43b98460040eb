-- title: A node may publish by a timer what seems to answer messages
-- description: A node without traced callbacks (rclpy, wait sets) publishes after messages, but not
--     as answers come: at the times of a timer, at intervals that the messages do not have, more
--     often than usual, after a message to another node, after a sleep, or too rarely to tell. Or
--     its node took a response or a goal, too, which may be the reason. Such
--     links are marked by candidate_count 2 in link_causal, and flows, paths and latencies do not
--     follow them.
-- cause: Timers of rclpy emit no event when they fire, and loops with a clock of their own none
--     either, so that what they publish follows some message. Or callbacks are so long that the
--     trace cannot tell.
-- cure: Say which it is in a file of links, kind independent or direct (docs/links.md), and apply
--     it with msgflow links apply FILE; msgflow suggest links prints the entries.
-- grain: one row per node
-- severity: warning
-- when: store.link_causal WHERE kind = 'take_adjacent' AND candidate_count > 1
WITH pair AS (
    SELECT
        l.run_id, p.node_id, p.process_id,
        s.topic_name AS input,
        p.topic_name AS output,
        count(*) AS link_count
    FROM store.link_causal AS l
    JOIN store.publisher AS p ON l.publisher_id = p.publisher_id
    LEFT JOIN store.subscription AS s ON l.subscription_id = s.subscription_id
    -- All links of an ambiguous process are doubtful, for another reason.
    JOIN store.process AS o ON p.process_id = o.process_id
    WHERE l.kind = 'take_adjacent' AND l.candidate_count > 1 AND NOT p.is_internal
        AND NOT coalesce(o.is_ambiguous, false)
    GROUP BY ALL
)
SELECT
    run_id, process_id, node_id,
    sum(link_count)::BIGINT AS count,
    string_agg(
        printf(
            '%s after %s (%s)', coalesce(output, '?'), coalesce(input, '?'),
            derive.counted(link_count, 'publication')
        ),
        ', ' ORDER BY output, input, link_count
    ) AS detail
FROM pair
GROUP BY run_id, process_id, node_id
