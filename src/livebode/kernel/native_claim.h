// One thread at a time in what a call changes: a second one is refused instead of waiting, since whoever shares a state
// between threads has made a mistake. The interpreter's lock does not see to it: long work releases it, and a
// free-threaded Python has none.
#ifndef LIVEBODE_NATIVE_CLAIM_H
#define LIVEBODE_NATIVE_CLAIM_H

#include <Python.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <stdexcept>
#include <vector>

namespace native {

class Flag {
  public:
    Flag() = default;
    Flag(const Flag &) = delete;
    Flag &operator=(const Flag &) = delete;

    // Whether it was free; then it is the caller's until `give`.
    bool take() noexcept
    {
#ifdef Py_GIL_DISABLED
        return !taken_.exchange(true, std::memory_order_acquire);
#else
        // The lock is held here, so that a store is enough: `push` would notice an exchange.
        const bool was_free = !taken_.load(std::memory_order_acquire);
        if (was_free) taken_.store(true, std::memory_order_relaxed);
        return was_free;
#endif
    }
    void give() noexcept { taken_.store(false, std::memory_order_release); }

  private:
    std::atomic<bool> taken_{false};
};

// Holds a flag to the end of the scope.
class Claim {
  public:
    Claim(Flag &flag, const char *refusal) : flag_(flag)
    {
        if (!flag.take()) throw std::runtime_error(refusal);
    }
    ~Claim() { flag_.give(); }
    Claim(const Claim &) = delete;
    Claim &operator=(const Claim &) = delete;

  private:
    Flag &flag_;
};

// Memory of arrays that calls change at the moment, for states that are arrays of Python.
class Changing {
  public:
    static bool take(const void *memory)
    {
        const std::lock_guard<std::mutex> lock(mutex());
        auto &now = all();
        if (std::find(now.begin(), now.end(), memory) != now.end()) return false;
        now.push_back(memory);
        return true;
    }
    static void give(const void *memory)
    {
        const std::lock_guard<std::mutex> lock(mutex());
        auto &now = all();
        now.erase(std::find(now.begin(), now.end(), memory));
    }

  private:
    static std::mutex &mutex()
    {
        static std::mutex one;
        return one;
    }
    static std::vector<const void *> &all()
    {
        static std::vector<const void *> now;
        return now;
    }
};

} // namespace native

#endif
