-- title: What makes data late, or lets them get lost, the worst first
-- description: One culprit for each chain of causes: of several that explain the same callback, the
--     one whose kind is more exact holds. The harm is by how much older the data at the end of the
--     path are on average, of those that are lost until the next ones. If nothing stands out, one
--     row says what takes most of the slowest path.
-- grain: one row per culprit
-- reads: application_path, breakdown, callback_name, culprit, noticed
-- column: rank BIGINT  Place, from 1; NULL: nothing stands out
-- column: kind VARCHAR  What it does: the file of `schema/culprit`; NULL: nothing stands out
-- column: node VARCHAR  Node; of a kind that concerns two, the one that takes the message, or waits
-- column: callback VARCHAR  What triggers its callback; NULL: not one callback
-- column: function VARCHAR  Function of the callback, without its module; NULL: not known
-- column: source VARCHAR  File and line at which the function begins; NULL: not known
-- column: other VARCHAR  Who else has to do with it: a server, a publisher, who holds a lock, or a
--     program
-- column: other_callback VARCHAR  What triggers the callback of that
-- column: other_function VARCHAR  Function of that
-- column: topic_name VARCHAR  Topic whose messages are late or lost
-- column: path VARCHAR [path]  Path that it delays most
-- column: harm_ns BIGINT [ns]  Mean time by which the data at the end of the path are older
-- column: p95_ns BIGINT [ns]  95 % of the messages are delayed by no more at one place
-- column: lost BIGINT  Messages lost
-- column: published BIGINT  Of so many
-- column: headline VARCHAR  Who, what kind, how much of what
-- column: evidence VARCHAR[]  What shows it: two lines at most
-- column: lacks VARCHAR  What was not recorded that would tell more: 'cpu', the CPU time of
--     callbacks, 'samples' of the system, or 'callbacks'
WITH numbered AS (
    SELECT
        *,
        row_number() OVER (ORDER BY place, harm_ns DESC, node, callback, path, topic_name) AS number
    FROM culprit
),
chosen AS (
    SELECT
        *,
        -- As a reader says them: the function, and what triggers it where there is room.
        coalesce(function, callback) AS name,
        coalesce(function || ' (' || callback || ')', callback) AS long_name,
        coalesce(other_function, other_callback) AS other_name,
        main.duration_text(run_ns) AS run,
        main.duration_text(usual_ns) AS usual,
        CASE
            WHEN long_calls > 0 THEN printf(' in %d of %d calls', long_calls, count)
            -- Of so few, 95 % are all.
            WHEN run_ns > usual_ns AND count < 20 THEN printf(' (longest of %d)', count)
            WHEN run_ns > usual_ns THEN ' (p95)'
            ELSE ''
        END
        || CASE WHEN NOT is_trend THEN coalesce(
            printf(' from %.3g s to %.3g s', since_ns / 1e9, until_ns / 1e9),
            printf(' since %.3g s', since_ns / 1e9)
        ) ELSE '' END AS at_times,
        coalesce(topic_name, '?') AS topic
    FROM numbered AS c
    CROSS JOIN noticed AS l
    WHERE NOT EXISTS (
        FROM numbered AS o
        WHERE o.number < c.number AND list_has_any(
                o.claims,
                CASE
                    WHEN c.kind = 'waits' THEN c.claims
                    ELSE list_filter(c.claims, lambda claim: NOT ends_with(claim, ' waits'))
                END
            )
            -- What is not known is explained by what does at least as much harm, or, where nothing
            -- tells whether there was a CPU, ten times as much.
            AND (
                c.kind <> 'waits' OR o.kind = 'waits'
                OR o.harm_ns * CASE WHEN c.lacks = 'samples' AND c.p95_ns >= l.late_ns
                    THEN l.of_path ELSE 1 END >= c.harm_ns
            )
    )
),
said AS (
    SELECT
        *,
        CASE kind
            WHEN 'action' THEN printf(
                '%s %s for %s%s', long_name,
                CASE WHEN waiting_callback IS NULL THEN 'executes a goal'
                    ELSE 'blocks its executor' END,
                run, at_times
            )
            WHEN 'service' THEN CASE WHEN is_awaited IS NULL
                THEN printf(
                    '%s takes %s%s, and data of %s wait for it', long_name, run, at_times, other
                )
            ELSE printf(
                '%s %s %s for %s%s', name,
                CASE WHEN is_awaited THEN 'awaits' ELSE 'waits for' END, service_name, run, at_times
            ) || coalesce(printf(' (%s of %s)', other_name, other), '') END
            WHEN 'overload' THEN printf(
                'its thread is asked for %.0f %% of its time: %d callbacks like %s, %s every %s',
                100 * load, count, name, run, main.duration_text(period_ns)
            )
            WHEN 'hangs' THEN printf('%s does not end', name) || coalesce(
                printf(': its request to %s', service_name) || CASE reason
                    WHEN 'untaken' THEN ' was answered, and the answer was not taken'
                    WHEN 'own' THEN ' of its own process was never answered'
                    ELSE ' was never answered'
                END,
                ''
            )
            WHEN 'untaken' THEN reason
            WHEN 'unfinished' THEN reason
            WHEN 'burst' THEN printf(
                '%s sends up to %d messages on %s at once, every %s',
                coalesce(long_name, 'it'), count, topic, main.duration_text(period_ns)
            )
            WHEN 'computes' THEN printf(
                '%s computes %s%s%s', long_name,
                CASE
                    WHEN share < nearly_all THEN printf('for %.0f %% of ', 100 * share)
                    ELSE ''
                END,
                run, at_times
            )
            WHEN 'garbage_collection' THEN printf(
                '%s collects garbage for %.0f %% of %s%s', long_name, 100 * share, run, at_times
            )
            WHEN 'interpreter' THEN printf(
                '%s waits while another thread of its process computes, for %.0f %% of %s%s',
                long_name, 100 * share, run, at_times
            )
            WHEN 'sleeps' THEN printf(
                '%s %s for %.0f %% of %s%s', long_name,
                CASE WHEN is_supposed THEN 'sleeps or waits' ELSE 'sleeps' END, 100 * share, run,
                at_times
            )
            WHEN 'disk' THEN printf(
                '%s waits for the disk, for %.0f %% of %s%s', long_name, 100 * share, run, at_times
            )
            WHEN 'lock' THEN printf(
                '%s waits %s (p95) for a lock that %s holds', name, run, other_name
            )
            WHEN 'no_cpu' THEN printf(
                '%s %s%s', coalesce(long_name, 'its thread'),
                coalesce(
                    printf('has no CPU for %.0f %% of %s%s', 100 * share, run, at_times),
                    printf('waits %s (p95) for a CPU', main.duration_text(p95_ns))
                ),
                coalesce(
                    CASE WHEN quota IS NOT NULL THEN coalesce(
                        printf(': its quota of %g CPUs stops it', cpus), ': its quota stops it'
                    ) END,
                    CASE reason
                        WHEN 'quota' THEN ': a quota stops it'
                        WHEN 'real_time_limit' THEN ': the limit of real-time threads stops it'
                        WHEN 'unused_cpu' THEN ': its CPU is offline, or isolated'
                    END,
                    printf(': %s has it', other),
                    ''
                )
            )
            WHEN 'stale' THEN printf(
                '%s %s data%s for up to %s', long_name,
                CASE WHEN is_supposed THEN 'may keep' ELSE 'keeps' END,
                coalesce(printf(' of %s', topic_name), ''), main.duration_text(period_ns)
            )
            WHEN 'other_input' THEN printf(
                'keeps data for %s for %s (p95), until further messages on its inputs come', topic,
                main.duration_text(p95_ns)
            )
            WHEN 'stopped' THEN coalesce(
                printf(
                    '%s stopped at %.3g s, %d calls are missing', callback, since_ns / 1e9, lost
                ),
                printf(
                    'publishes nothing on %s since %.3g s, %d messages are missing', topic,
                    since_ns / 1e9, lost
                )
            )
            WHEN 'paused' THEN printf(
                '%s pauses %d times, for up to %s, while %s of %s runs', topic, count, run,
                other_callback, other
            )
            WHEN 'restart' THEN printf('ended, and ran again after %s', run)
            || coalesce(
                printf(': %d of %d messages on %s were lost', lost, published, topic_name), ''
            )
            WHEN 'never_matched' THEN printf(
                'received none of the %d messages on %s%s: likely QoS or %s', published, topic,
                coalesce(printf(' from %s', other), ''),
                CASE WHEN is_supposed THEN 'discovery' ELSE 'domain' END
            )
            WHEN 'late_start' THEN printf(
                'started %s after the others and missed %d of %d messages on %s', run, lost,
                published, topic
            )
            WHEN 'lost'
                THEN printf('%d of %d messages on %s were lost on the way', lost, published, topic)
            WHEN 'waits' THEN CASE
                WHEN p95_ns > 0 THEN printf(
                    '%s %s wait %s (p95)%s',
                    CASE WHEN regexp_matches(callback, '^(Service|Action)') THEN 'requests to'
                        ELSE 'messages on' END,
                    topic, main.duration_text(p95_ns),
                    CASE WHEN is_supposed THEN ' for the next one: its executor is not woken'
                        WHEN count IS NULL THEN ''
                        ELSE ': its executor polls without a pause' END
                )
                ELSE printf('%d of %d messages on %s were overwritten', lost, published, topic)
            END
            WHEN 'callback' THEN printf(
                '%s takes %s%s', coalesce(long_name, printf('between its input and %s, it', topic)),
                run, at_times
            )
        END AS what,
        list_filter(
            [
                CASE
                    WHEN kind = 'hangs' AND is_supposed THEN 'a synchronous call: let the callback'
                        ' return, or give the client a callback group and a thread of its own'
                    WHEN kind IN (
                        'hangs', 'restart', 'never_matched', 'late_start', 'unfinished', 'untaken'
                    )
                        THEN NULL
                    ELSE printf(
                        'data on %s are %s older by it on average',
                        regexp_replace(path, ' → .+ → .+ → ', ' → … → '),
                        main.duration_text(harm_ns)
                    )
                END,
                array_to_string(
                    list_filter(
                        [
                            CASE WHEN kind IN ('callback', 'computes', 'sleeps', 'disk')
                                AND long_calls > 0 THEN printf('usually it takes %s', usual) END,
                            printf(
                                '%s wakes it',
                                CASE woken_by
                                    WHEN 'timer' THEN 'a timer of the kernel'
                                    WHEN 'thread' THEN 'another thread'
                                    WHEN 'interrupt' THEN 'a device'
                                    WHEN 'softirq' THEN 'the network or a device'
                                END
                            ),
                            CASE WHEN is_trend THEN printf(
                                'it grows from %s to %s during the run',
                                main.duration_text(before_ns), main.duration_text(after_ns)
                            ) ELSE printf(
                                'before, it took %s%s', main.duration_text(before_ns),
                                coalesce('; ' || occasion || ' then', '')
                            ) END,
                            CASE WHEN kind = 'stopped' THEN coalesce(
                                occasion,
                                CASE WHEN starts_with(callback, 'Timer')
                                    THEN 'cancelled, no executor looks at it, or its clock stands:'
                                        ' not known' END
                            ) END,
                            CASE WHEN kind = 'no_cpu' THEN printf(
                                'it computes for %.0f %% of it', 100 * running_ns / measured_ns
                            ) END,
                            CASE WHEN kind = 'callback' THEN printf(
                                'on a CPU for %.0f %% of it, ready without one for %.0f %%',
                                100 * running_ns / measured_ns, 100 * waiting_ns / measured_ns
                            ) END,
                            printf('%s used %.1f of %d CPUs', other, used_cpus, cpus::INTEGER),
                            printf(
                                'throttled %d times, for %s in all, as %s', throttled_count,
                                main.duration_text(throttled_ns), quota
                            ),
                            CASE WHEN load >= 0.9 AND kind <> 'overload' THEN printf(
                                'its thread is asked for %.0f %% of its time', 100 * load
                            ) END,
                            printf(
                                '%s come in, %s are taken',
                                derive.rate_text(1e9 * per_take / period_ns),
                                derive.rate_text(1e9 / period_ns)
                            ),
                            CASE
                                WHEN is_held THEN printf('messages on %s come when it ends', topic)
                                WHEN kind = 'burst' THEN printf(
                                    '%s of %s takes one after the other', waiting_callback,
                                    waiting_node
                                )
                                WHEN waiting_callback IS NOT NULL THEN printf(
                                    'it keeps %s of %s waiting', waiting_callback, waiting_node
                                )
                            END,
                            CASE WHEN lost > 0 AND kind NOT IN (
                                'restart', 'never_matched', 'late_start', 'lost', 'stopped'
                            ) THEN printf(
                                '%d of %d messages on %s were overwritten', lost, published, topic
                            ) END,
                            CASE WHEN is_supposed AND kind = 'lock'
                                THEN 'as far as times show: it goes on when that one ends' END,
                            CASE WHEN is_supposed AND kind = 'service'
                                THEN 'as far as times show: requests are recorded since Kilted' END,
                            CASE
                                WHEN lacks = 'callbacks' THEN 'its callbacks are not traced'
                                WHEN lacks = 'samples' AND kind = 'waits'
                                    THEN 'on the way, or its thread has no CPU: not known'
                                WHEN lacks = 'samples'
                                    THEN 'it sleeps or has no CPU: not known'
                                WHEN lacks = 'cpu'
                                    THEN 'computed, slept or had no CPU: not known'
                            END
                        ],
                        lambda part: part IS NOT NULL
                    ),
                    '; '
                )
            ],
            lambda line: line <> ''
        ) AS evidence
    FROM chosen
),
longest AS (
    SELECT
        a.path, a.p95_ns, a.reached, b.part, b.what, b.node,
        b.p95_ns AS longest_ns
    FROM application_path AS a
    JOIN breakdown AS b ON a.path = b.path
    ORDER BY a.p95_ns DESC, a.path, b.total_ns DESC, b.hop
    LIMIT 1
)
SELECT
    -- What is known comes before what is not; what a start delays is over soon.
    row_number() OVER (
        ORDER BY
            CASE kind WHEN 'late_start' THEN 2 WHEN 'waits' THEN 1 ELSE 0 END,
            harm_ns DESC,
            number
    ) AS rank,
    kind, node, callback, function,
    (
        SELECT any_value(n.source)
        FROM callback_name AS n
        WHERE n.node = said.node AND n.callback = said.callback
    ) AS source,
    other, other_callback, other_function, topic_name, path, harm_ns, p95_ns, lost, published,
    printf(
        '%s: %s', node,
        -- What triggers the callback stands there where the line has room for it.
        CASE
            WHEN length(node) + length(what) > 98
                THEN coalesce(replace(what, long_name, name), what)
            ELSE what
        END
    ) AS headline,
    evidence, lacks
FROM said
UNION ALL
SELECT
    NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, l.path, NULL, l.p95_ns, NULL, NULL,
    'nothing stands out',
    list_filter(
        [
            -- Of so few, 95 % are all.
            printf(
                '%s the slowest path arrive within %s',
                CASE WHEN l.reached < 20 THEN printf('all %d flows of', l.reached)
                    ELSE '95 % of the data on' END,
                main.duration_text(l.p95_ns)
            ),
            printf(
                CASE
                    WHEN l.part = 'response_to_take' THEN '%2$s waits longest for an answer'
                    WHEN l.part IN ('publish', 'intra', 'rclcpp', 'rcl', 'rmw', 'dds')
                        THEN '%2$s takes longest to publish on %1$s'
                    -- Without a traced callback its topic is what it publishes.
                    WHEN l.part = 'callback' AND starts_with(l.what, '/')
                        THEN '%2$s takes longest, between its input and %1$s'
                    WHEN l.part IN ('callback', 'service') THEN '%1$s of %2$s takes longest'
                    WHEN l.node = 'between nodes' AND NOT starts_with(l.what, '/')
                        THEN 'it takes longest until a request to %1$s is taken'
                    WHEN l.node = 'between nodes' OR starts_with(l.what, '/')
                        THEN 'it takes longest until %1$s is taken'
                    ELSE 'it takes longest until %1$s of %2$s begins'
                END || ': %3$s (%4$s)',
                l.what, l.node, main.duration_text(l.longest_ns),
                CASE WHEN l.reached < 20 THEN 'at most' ELSE 'p95' END
            )
        ],
        lambda line: line IS NOT NULL
    ),
    NULL
FROM (SELECT 1)
LEFT JOIN longest AS l ON true
WHERE NOT EXISTS (FROM said)
ORDER BY rank
