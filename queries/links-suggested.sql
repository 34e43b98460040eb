-- title: Links that the data suggest
-- description: Where messages seem to be kept: they lead nowhere, while a timer, or messages on
--     another topic, lead to publications (periodic_async); callbacks of several subscriptions
--     publish only once each of them has had a message (partial_sync), or later, when it is clear
--     which are closest in time (approximate_sync); or the node publishes outside of callbacks, a
--     message for each that came (queue). And where a node without traced callbacks seems to
--     publish by itself (independent). Only the author of the node knows: review the candidates
--     before you apply any.
-- grain: one row per candidate
-- param: min_share DOUBLE = 0.95    Minimum share of publications that had a new message of a
--     topic, for it to count as an input of a partial_sync candidate; and of those that did not
--     wait for longer
-- column: run_id
-- column: kind VARCHAR              'periodic_async', 'queue', 'partial_sync', 'approximate_sync'
--     or 'independent'
-- column: node VARCHAR [node]  Node
-- column: inputs VARCHAR[] [topic]  Topics of the inputs
-- column: outputs VARCHAR[] [topic]  Topics of the outputs
-- column: evidence VARCHAR          What was seen
-- column: doubt VARCHAR             Why it may be incomplete or misleading; empty: nothing known
-- column: process VARCHAR           Process name of the node
-- column: pid INTEGER               Process id of the node
-- column: host VARCHAR [host]  Host of the node
-- column: is_name_repeated BOOLEAN  Several nodes of the run have this name
-- brief: kind, node, inputs, outputs, evidence, doubt
WITH named_node AS (
    SELECT
        n.run_id, n.node_id,
        main.node_name(n.full_name) AS full_name,
        p.name AS process,
        p.pid,
        h.hostname AS host,
        count(*) OVER (PARTITION BY n.run_id, main.node_name(n.full_name)) > 1 AS is_name_repeated
    FROM main.node AS n
    JOIN main.process AS p ON n.process_id = p.process_id
    JOIN main.host AS h ON p.host_id = h.host_id
    WHERE list_contains($runs, n.run_id) AND n.full_name IS NOT NULL
),
input_run AS (
    SELECT
        s.node_id, s.subscription_id, s.topic_name, i.callback_instance_id, i.start_ns,
        coalesce(i.end_ns, i.start_ns) AS end_ns,
        coalesce(contains(c.symbol, 'message_filters::'), false) AS is_filtered
    FROM main.subscription AS s
    JOIN named_node AS n ON s.node_id = n.node_id
    JOIN main.callback AS c ON s.subscription_id = c.subscription_id
    JOIN main.callback_instance AS i ON c.callback_id = i.callback_id
    WHERE NOT s.is_internal AND s.topic_name IS NOT NULL
),
caused AS (
    SELECT
        l.callback_instance_id, l.publication_id, l.kind, b.publisher_id, b.start_ns,
        p.topic_name, p.node_id
    FROM main.link_causal AS l
    JOIN main.publication AS b ON l.publication_id = b.publication_id
    JOIN main.publisher AS p ON b.publisher_id = p.publisher_id
    WHERE list_contains($runs, l.run_id) AND NOT p.is_internal AND p.topic_name IS NOT NULL
),
input AS (
    SELECT
        r.node_id, r.subscription_id, r.topic_name,
        bool_and(r.is_filtered) AS is_filtered,
        count(DISTINCT r.callback_instance_id) AS run_count,
        count(DISTINCT c.callback_instance_id) AS leading_count
    FROM input_run AS r
    LEFT JOIN caused AS c ON r.callback_instance_id = c.callback_instance_id
    GROUP BY r.node_id, r.subscription_id, r.topic_name
),
-- Messages lead nowhere, while timers or other messages lead to publications.
dead_end AS MATERIALIZED (
    SELECT
        *,
        timer_id IS NOT NULL AS is_timed,
        coalesce(timer_id, trigger_id) IS NULL AS is_outside
    FROM main.dead_end($runs)
),
queued AS (
    SELECT
        node_id,
        'queue' AS kind,
        [topic_name] AS inputs,
        list(DISTINCT output_topic ORDER BY output_topic) AS outputs,
        printf(
            'it published %s outside of callbacks, as %d messages on %s came, each after the one of'
            || ' its number',
            string_agg(
                printf('%d messages on %s', publication_count, output_topic), ' and '
                ORDER BY output_topic, publisher_id
            ),
            message_count, topic_name
        ) AS evidence,
        concat_ws(
            '; ',
            CASE WHEN bool_or(is_loop) THEN
                printf('messages on %s descend from what the node publishes', topic_name) END,
            CASE WHEN bool_or(is_pool) THEN
                'several threads published: one may have overtaken another' END
        ) AS doubt
    FROM dead_end
    WHERE is_queue
    GROUP BY node_id, subscription_id, topic_name, message_count
),
declared AS (
    SELECT o.publisher_id
    FROM main.annotation AS a
    JOIN main.annotation_output AS o ON a.annotation_id = o.annotation_id
    WHERE a.kind IN ('partial_sync', 'approximate_sync')
),
-- Callbacks of subscriptions publish once per set of messages.
fired AS (
    SELECT
        c.publisher_id,
        c.topic_name AS output_topic,
        r.node_id, r.subscription_id, r.callback_instance_id, r.start_ns,
        min(c.start_ns) AS published_ns
    FROM caused AS c
    JOIN input_run AS r ON c.callback_instance_id = r.callback_instance_id
    ANTI JOIN declared AS d ON c.publisher_id = d.publisher_id
    WHERE c.kind = 'direct' AND c.node_id = r.node_id
    GROUP BY ALL
),
firing AS (
    SELECT
        *,
        lag(published_ns) OVER (
            PARTITION BY publisher_id ORDER BY published_ns, callback_instance_id
        ) AS emptied_ns
    FROM fired
),
firing_input AS (
    SELECT
        f.* REPLACE (i.subscription_id AS subscription_id),
        f.subscription_id = i.subscription_id AS is_own
    FROM firing AS f
    JOIN input AS i ON f.node_id = i.node_id
),
-- A node that publishes as soon as it has a message of every input does so with the first one of
-- the input that came last.
patient AS (
    SELECT
        f.publisher_id,
        count(*) AS patient_count
    FROM firing AS f
    ASOF JOIN input_run AS r ON f.subscription_id = r.subscription_id AND f.start_ns > r.start_ns
    WHERE r.start_ns > f.emptied_ns
    GROUP BY f.publisher_id
),
-- An input counts where its messages lead nowhere else, or to this output.
met AS (
    SELECT
        f.publisher_id, f.output_topic, f.node_id, f.subscription_id,
        count(*) AS firing_count,
        count(CASE WHEN f.is_own THEN 1 END) AS own_count,
        count(
            CASE
                WHEN f.is_own THEN 1
                WHEN own.callback_instance_id IS NULL
                    AND coalesce(r.end_ns > f.emptied_ns, r.end_ns IS NOT NULL) THEN 1
            END
        ) AS met_count
    FROM firing_input AS f
    ASOF LEFT JOIN input_run AS r
        ON f.subscription_id = r.subscription_id AND f.published_ns >= r.start_ns
    LEFT JOIN fired AS own
        ON f.publisher_id = own.publisher_id AND r.callback_instance_id = own.callback_instance_id
    GROUP BY f.publisher_id, f.output_topic, f.node_id, f.subscription_id
),
synchronous AS (
    SELECT
        m.node_id, m.publisher_id, m.output_topic,
        any_value(m.firing_count) AS firing_count,
        list(DISTINCT i.topic_name ORDER BY i.topic_name) AS inputs,
        string_agg(
            printf('%d of %d messages on %s published', m.own_count, i.run_count, i.topic_name),
            ', ' ORDER BY i.topic_name, i.subscription_id
        ) AS evidence,
        min(m.met_count) AS met_count,
        coalesce(any_value(p.patient_count), 0) AS patient_count,
        CASE
            WHEN bool_and(i.is_filtered) AND min(m.own_count) = 0 THEN 'approximate_sync'
            WHEN any_value(p.patient_count) > any_value(m.firing_count) * (1 - $min_share)
                THEN 'approximate_sync'
            ELSE 'partial_sync'
        END AS kind,
        bool_and(i.is_filtered) AS is_filtered
    FROM met AS m
    JOIN input AS i ON m.subscription_id = i.subscription_id
    LEFT JOIN patient AS p ON m.publisher_id = p.publisher_id
    WHERE m.met_count >= m.firing_count * $min_share
        -- An output that waits for a message is published by the run that gets it. Where no output
        -- waited for any message of an input, the latest one counts, as for periodic_async, unless
        -- the callbacks are those of a filter.
        AND (
            m.own_count > 0
            OR i.leading_count = 0
            AND (i.is_filtered OR p.patient_count > m.firing_count * (1 - $min_share))
        )
    GROUP BY m.node_id, m.publisher_id, m.output_topic
    HAVING count(DISTINCT i.topic_name) > 1 AND any_value(m.firing_count) >= 3
        AND sum(i.run_count) > any_value(m.firing_count)
),
partial AS (
    SELECT
        node_id, kind, inputs,
        list(DISTINCT output_topic ORDER BY output_topic) AS outputs,
        printf(
            '%d of %d publications on %s came after a message of each input since the one before;'
            || '%s %s',
            min(met_count),
            min(firing_count),
            string_agg(DISTINCT output_topic, ' and ' ORDER BY output_topic),
            CASE
                WHEN kind = 'approximate_sync' AND min(patient_count) > 0 THEN
                    printf(' %d waited for a further message;', min(patient_count))
                ELSE ''
            END,
            min(evidence)
        ) AS evidence,
        CASE
            WHEN bool_and(is_filtered) THEN
                'its callbacks are of message_filters: approximate_sync for ApproximateTime, '
                || 'partial_sync for TimeSynchronizer'
            WHEN kind = 'approximate_sync' THEN
                'it is supposed that message_filters (ApproximateTime) chose the messages'
        END AS doubt
    FROM synchronous
    GROUP BY node_id, kind, inputs
),
-- What one timer published, or the callbacks of one subscription.
published AS (
    SELECT
        subscription_id, is_timed, timer_id, trigger_id,
        printf(
            '%s %s',
            string_agg(
                printf('%d messages on %s', publication_count, output_topic), ' and '
                ORDER BY output_topic, publisher_id
            ),
            cause
        ) AS evidence
    FROM dead_end
    WHERE NOT is_queue
    GROUP BY subscription_id, is_timed, timer_id, trigger_id, cause
),
cause AS (
    SELECT
        subscription_id, is_timed,
        string_agg(evidence, ', ' ORDER BY timer_id, trigger_id) AS evidence
    FROM published
    GROUP BY subscription_id, is_timed
),
-- A timer that publishes has what it needs from somewhere. Other messages are a cause already: one
-- output may use what is kept, and another not.
undecided AS (
    SELECT subscription_id
    FROM dead_end
    GROUP BY subscription_id
    HAVING count(DISTINCT timer_id) > 1
        OR count(DISTINCT CASE WHEN NOT is_timed THEN publisher_id END) > 1
        OR count(*) < count(DISTINCT publisher_id)
        * (count(DISTINCT timer_id) + count(DISTINCT trigger_id))
),
chosen_by_time AS (SELECT DISTINCT publisher_id FROM synchronous WHERE kind = 'approximate_sync'),
kept AS (
    SELECT
        d.node_id, d.subscription_id, d.is_timed, d.topic_name, d.message_count, d.leading_count,
        list(DISTINCT d.output_topic ORDER BY d.output_topic) AS outputs,
        concat_ws(
            '; ',
            CASE WHEN d.leading_count > 0 THEN
                printf('%d others on %s lead on directly', d.leading_count, d.topic_name) END,
            CASE WHEN count(u.subscription_id) > 0 THEN
                'which of its outputs use the messages is not known' END,
            CASE WHEN bool_or(d.is_loop) THEN
                printf('messages on %s descend from what the node publishes', d.topic_name) END,
            CASE WHEN NOT d.is_timed AND count(a.publisher_id) > 0 THEN
                'message_filters (ApproximateTime) may choose the messages' END,
            CASE WHEN bool_or(d.is_outside) THEN
                'a thread that publishes by itself may not use the messages at all' END,
            CASE WHEN NOT d.is_timed AND sum(d.early_count) > 0 THEN
                printf(
                    '%d messages were published before the first one on %s came',
                    sum(d.early_count), d.topic_name
                ) END,
            CASE WHEN NOT d.is_timed AND max(d.run_ns) > min(d.publishing_run_ns) THEN
                printf(
                    'callbacks of %s run for %.3g ms, those that publish for %.3g ms: to keep a '
                    || 'message takes less',
                    d.topic_name, max(d.run_ns) / 1e6, min(d.publishing_run_ns) / 1e6
                ) END
        ) AS doubt
    FROM dead_end AS d
    LEFT JOIN undecided AS u ON d.subscription_id = u.subscription_id
    LEFT JOIN chosen_by_time AS a ON d.publisher_id = a.publisher_id
    WHERE NOT d.is_queue
    GROUP BY
        d.node_id, d.subscription_id, d.is_timed, d.topic_name, d.message_count, d.leading_count
),
periodic AS (
    SELECT
        k.node_id,
        'periodic_async' AS kind,
        list(DISTINCT k.topic_name ORDER BY k.topic_name) AS inputs,
        k.outputs,
        printf(
            'it published %s, while %s led nowhere',
            c.evidence,
            string_agg(
                printf('%d messages on %s', k.message_count - k.leading_count, k.topic_name),
                ' and '
                ORDER BY k.topic_name, k.subscription_id
            )
        ) AS evidence,
        nullif(k.doubt, '') AS doubt
    FROM kept AS k
    JOIN cause AS c ON k.subscription_id = c.subscription_id AND k.is_timed = c.is_timed
    GROUP BY k.node_id, k.is_timed, k.outputs, c.evidence, k.doubt
),
-- What may have been published by a timer that shows no event.
doubtful AS (
    SELECT
        p.node_id, p.publisher_id,
        s.topic_name AS input_topic,
        p.topic_name AS output_topic,
        count(*) AS link_count,
        quantile_disc(l.wait_ns, [0.1, 0.9]) AS waits
    FROM main.link_causal AS l
    JOIN main.take AS t ON l.take_id = t.take_id
    JOIN main.subscription AS s ON t.subscription_id = s.subscription_id
    JOIN main.publication AS b ON l.publication_id = b.publication_id
    JOIN main.publisher AS p ON b.publisher_id = p.publisher_id
    -- There, a link is doubtful for another reason.
    JOIN main.process AS o ON p.process_id = o.process_id
    WHERE list_contains($runs, l.run_id)
        AND NOT coalesce(o.is_ambiguous, false)
        AND l.kind = 'take_adjacent' AND l.candidate_count > 1
        AND NOT p.is_internal AND NOT s.is_internal AND s.node_id = p.node_id
    GROUP BY ALL
),
independent AS (
    SELECT
        node_id,
        'independent' AS kind,
        list(DISTINCT input_topic ORDER BY input_topic) AS inputs,
        [output_topic] AS outputs,
        string_agg(
            printf(
                '%d of %d messages on %s came %.3g to %.3g ms after one on %s', d.link_count,
                b.publication_count, d.output_topic, d.waits[1] / 1e6, d.waits[2] / 1e6,
                d.input_topic
            ),
            ', ' ORDER BY d.input_topic, d.publisher_id
        ) AS evidence,
        'if it does answer these messages, write direct instead' AS doubt
    FROM doubtful AS d
    JOIN (
        SELECT
            publisher_id,
            count(*) AS publication_count
        FROM main.publication
        WHERE list_contains($runs, run_id)
        GROUP BY publisher_id
    ) AS b ON d.publisher_id = b.publisher_id
    GROUP BY d.node_id, d.output_topic
),
-- It may keep the messages for what it publishes by itself.
kept_by_hand AS (
    SELECT
        * REPLACE (
            'periodic_async' AS kind,
            'only if the node keeps these messages for what it publishes by itself' AS doubt
        )
    FROM independent
),
received AS (
    SELECT
        node_id,
        list(DISTINCT topic_name ORDER BY topic_name) AS topics
    FROM input
    WHERE leading_count > 0
    GROUP BY node_id
),
candidate AS (
    SELECT
        *,
        kind IN ('partial_sync', 'approximate_sync') AS is_set
    FROM (
        FROM periodic
        UNION ALL BY NAME FROM partial
        UNION ALL BY NAME FROM independent
        UNION ALL BY NAME FROM kept_by_hand
        UNION ALL BY NAME FROM queued
    )
)
SELECT
    n.run_id, c.kind,
    n.full_name AS node,
    c.inputs, c.outputs, c.evidence,
    nullif(
        concat_ws(
            '; ',
            c.doubt,
            CASE
                WHEN c.is_set AND count(*) OVER (PARTITION BY c.node_id, c.is_set) > 1 THEN
                    'the node has several candidates, which may share inputs, or be one'
            END,
            CASE
                WHEN c.is_set AND NOT list_has_all(c.inputs, r.topics) THEN
                    printf(
                        'the node also receives %s, which may be inputs as well',
                        array_to_string(
                            list_filter(r.topics, lambda topic: NOT list_contains(c.inputs, topic)),
                            ', '
                        )
                    )
            END
        ),
        ''
    ) AS doubt,
    n.process, n.pid, n.host, n.is_name_repeated
FROM candidate AS c
JOIN named_node AS n ON c.node_id = n.node_id
LEFT JOIN received AS r ON c.node_id = r.node_id
ORDER BY n.run_id, node, n.host, n.pid, c.kind, c.outputs, c.inputs, c.evidence, c.node_id
