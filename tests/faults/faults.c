// A library for LD_PRELOAD that makes one call of the system fail. It runs the program's main() again and again, each time in a
// child process, so that a test can walk over all calls of a program in the time of a few.
//
// The test writes lines "CLASS NUMBER ERROR" to descriptor 198: of the calls of this class, the one of this number (from 1) fails
// with this errno; 0 lets all succeed, and of the class `none` nothing fails. An ERROR of -1 makes the call transfer one byte
// only; one of -2 sends TERM to the process at the call. The library answers each line on descriptor 199: the wait status of
// the child, and the number of its calls of each class.
//
// Calls that the C library makes by itself (fwrite to a file, dlopen) are not seen. Calls before main() are not counted.

#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <link.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

enum { REQUESTS = 198, ANSWERS = 199, NO_NUMBER = -1, SHORT = -1, STOP = -2, MOST_SECONDS = 30 };

// Memory that libraries for C ask for is a class of its own: some of them end the process when they are refused any.
enum Class { MEMORY, MEMORY_LIBRARIES, OPEN, READ, WRITE, FSYNC, RENAME, MMAP, CLOSE, RESERVE, CLASSES };
static const char* const kNames[CLASSES] = {"memory", "memory_libraries", "open", "read",  "write",
                                            "fsync",  "rename",           "mmap", "close", "reserve"};

struct Shared {
  atomic_long counts[CLASSES];
};
static struct Shared* shared = NULL;  // set once main() is about to run
static int fault_class = CLASSES;
static long fault_number = NO_NUMBER;
static int fault_error = 0;
enum { MOST_PARTS = 16 };
static struct { uintptr_t begin, end; } library_parts[MOST_PARTS];  // machine code of kLibraries
static int part_count = 0;
static const char* const kLibraries[] = {"/libhdf5", "/libfftw3", "/libgomp", "/libglib-2"};

/// Counts a call, and says whether it is the one that fails. Sets errno.
static int fails(enum Class class) {
  if (shared == NULL) return 0;
  const long number = atomic_fetch_add(&shared->counts[class], 1) + 1;
  if ((int)class != fault_class || number != fault_number) return 0;
  if (fault_error == STOP) {
    raise(SIGTERM);
    return 0;
  }
  if (fault_error >= 0) errno = fault_error;
  return 1;
}

static enum Class memoryOf(void* caller) {
  for (int k = 0; k < part_count; ++k)
    if ((uintptr_t)caller >= library_parts[k].begin && (uintptr_t)caller < library_parts[k].end) return MEMORY_LIBRARIES;
  return MEMORY;
}

#define REAL(name) ((__typeof__(&name))real(#name))
static void* real(const char* name) { return dlsym(RTLD_NEXT, name); }

// Memory. The C library has second names for these.

extern void* __libc_malloc(size_t size);
extern void* __libc_calloc(size_t count, size_t size);
extern void* __libc_realloc(void* old, size_t size);
extern void* __libc_memalign(size_t alignment, size_t size);

void* malloc(size_t size) { return fails(memoryOf(__builtin_return_address(0))) ? NULL : __libc_malloc(size); }
void* calloc(size_t count, size_t size) {
  return fails(memoryOf(__builtin_return_address(0))) ? NULL : __libc_calloc(count, size);
}
void* realloc(void* old, size_t size) {
  return fails(memoryOf(__builtin_return_address(0))) ? NULL : __libc_realloc(old, size);
}
void* memalign(size_t alignment, size_t size) {
  return fails(memoryOf(__builtin_return_address(0))) ? NULL : __libc_memalign(alignment, size);
}
void* aligned_alloc(size_t alignment, size_t size) {
  return fails(memoryOf(__builtin_return_address(0))) ? NULL : __libc_memalign(alignment, size);
}
int posix_memalign(void** result, size_t alignment, size_t size) {
  if (fails(memoryOf(__builtin_return_address(0)))) return ENOMEM;
  *result = __libc_memalign(alignment, size);
  return *result == NULL ? ENOMEM : 0;
}

char* strdup(const char* text) {
  const size_t size = strlen(text) + 1;
  char* copy = fails(memoryOf(__builtin_return_address(0))) ? NULL : __libc_malloc(size);
  return copy == NULL ? NULL : memcpy(copy, text, size);
}

// Files.

static mode_t modeOf(int flags, va_list list) { return flags & (O_CREAT | O_TMPFILE) ? va_arg(list, mode_t) : 0; }

#define DEFINE_OPEN(name)                                                        \
  int name(const char* path, int flags, ...) {                                   \
    va_list list;                                                                \
    va_start(list, flags);                                                       \
    const mode_t mode = modeOf(flags, list);                                     \
    va_end(list);                                                                \
    return fails(OPEN) ? -1 : openat(AT_FDCWD, path, flags | O_LARGEFILE, mode); \
  }
DEFINE_OPEN(open)
DEFINE_OPEN(open64)

FILE* fopen(const char* path, const char* mode) { return fails(OPEN) ? NULL : REAL(fopen)(path, mode); }
FILE* fopen64(const char* path, const char* mode) { return fails(OPEN) ? NULL : REAL(fopen64)(path, mode); }

#define TRANSFER(class, call_short, call)                                                    \
  do {                                                                                       \
    if (!fails(class)) return call;                                                          \
    return fault_error == SHORT && size > 1 ? call_short : fault_error == SHORT ? call : -1; \
  } while (0)

ssize_t read(int file, void* to, size_t size) { TRANSFER(READ, REAL(read)(file, to, 1), REAL(read)(file, to, size)); }
ssize_t pread(int file, void* to, size_t size, off_t at) {
  TRANSFER(READ, REAL(pread)(file, to, 1, at), REAL(pread)(file, to, size, at));
}
ssize_t pread64(int file, void* to, size_t size, off64_t at) {
  TRANSFER(READ, REAL(pread64)(file, to, 1, at), REAL(pread64)(file, to, size, at));
}
ssize_t write(int file, const void* from, size_t size) {
  if (file == STDOUT_FILENO || file == STDERR_FILENO || file == ANSWERS) return REAL(write)(file, from, size);
  TRANSFER(WRITE, REAL(write)(file, from, 1), REAL(write)(file, from, size));
}
ssize_t pwrite(int file, const void* from, size_t size, off_t at) {
  TRANSFER(WRITE, REAL(pwrite)(file, from, 1, at), REAL(pwrite)(file, from, size, at));
}
ssize_t pwrite64(int file, const void* from, size_t size, off64_t at) {
  TRANSFER(WRITE, REAL(pwrite64)(file, from, 1, at), REAL(pwrite64)(file, from, size, at));
}
int fsync(int file) { return fails(FSYNC) ? -1 : REAL(fsync)(file); }
int rename(const char* from, const char* to) { return fails(RENAME) ? -1 : REAL(rename)(from, to); }
int link(const char* from, const char* to) { return fails(RENAME) ? -1 : REAL(link)(from, to); }
int posix_fallocate(int file, off_t at, off_t size) {
  return fails(RESERVE) ? fault_error : REAL(posix_fallocate)(file, at, size);
}
int posix_fallocate64(int file, off64_t at, off64_t size) {
  return fails(RESERVE) ? fault_error : REAL(posix_fallocate64)(file, at, size);
}
int ftruncate(int file, off_t size) { return fails(RESERVE) ? -1 : REAL(ftruncate)(file, size); }
int ftruncate64(int file, off64_t size) { return fails(RESERVE) ? -1 : REAL(ftruncate64)(file, size); }
int close(int file) {
  if (!fails(CLOSE)) return REAL(close)(file);
  REAL(close)(file);  // Linux frees the number even if it reports an error
  errno = fault_error;
  return -1;
}
void* mmap(void* at, size_t size, int protection, int flags, int file, off_t offset) {
  return fails(MMAP) ? MAP_FAILED : REAL(mmap)(at, size, protection, flags, file, offset);
}
void* mmap64(void* at, size_t size, int protection, int flags, int file, off64_t offset) {
  return fails(MMAP) ? MAP_FAILED : REAL(mmap64)(at, size, protection, flags, file, offset);
}

// The program's main(), once for each line.

static int findLibrary(struct dl_phdr_info* info, size_t size, void* unused) {
  (void)size, (void)unused;
  const char* name = strrchr(info->dlpi_name, '/');
  int wanted = 0;
  for (size_t k = 0; name != NULL && k < sizeof kLibraries / sizeof *kLibraries; ++k)
    wanted |= strncmp(name, kLibraries[k], strlen(kLibraries[k])) == 0;
  for (int k = 0; wanted && k < info->dlpi_phnum && part_count < MOST_PARTS; ++k) {
    const ElfW(Phdr)* part = &info->dlpi_phdr[k];
    if (part->p_type != PT_LOAD || !(part->p_flags & PF_X)) continue;
    library_parts[part_count].begin = info->dlpi_addr + part->p_vaddr;
    library_parts[part_count].end = info->dlpi_addr + part->p_vaddr + part->p_memsz;
    ++part_count;
  }
  return 0;
}

/// Reads a line, byte by byte. Returns 0 at the end.
static int readLine(char* line, size_t most) {
  size_t size = 0;
  while (size + 1 < most && REAL(read)(REQUESTS, line + size, 1) == 1) {
    if (line[size++] != '\n') continue;
    line[size] = '\0';
    return 1;
  }
  return 0;
}

static int (*program_main)(int, char**, char**) = NULL;

static int serve(int argc, char** argv, char** environment) {
  if (fcntl(REQUESTS, F_GETFD) < 0) return program_main(argc, argv, environment);
  dl_iterate_phdr(findLibrary, NULL);
  struct Shared* counts = REAL(mmap)(NULL, sizeof(struct Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  char line[128];
  while (readLine(line, sizeof line)) {
    char name[32] = "";
    if (sscanf(line, "%31s %ld %d", name, &fault_number, &fault_error) != 3) abort();
    memset(counts, 0, sizeof *counts);
    const pid_t child = fork();
    if (child == 0) {
      alarm(MOST_SECONDS);  // a run that hangs ends by a signal, which is a failure of the test
      REAL(close)(REQUESTS);
      REAL(close)(ANSWERS);
      for (fault_class = 0; fault_class < CLASSES && strcmp(kNames[fault_class], name) != 0;) ++fault_class;
      shared = counts;
      exit(program_main(argc, argv, environment));
    }
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    char answer[512];
    int size = snprintf(answer, sizeof answer, "%d", status);
    for (int k = 0; k < CLASSES; ++k)
      size += snprintf(answer + size, sizeof answer - (size_t)size, " %s=%ld", kNames[k], atomic_load(&counts->counts[k]));
    answer[size++] = '\n';
    if (REAL(write)(ANSWERS, answer, (size_t)size) != size) abort();
  }
  return 0;
}

typedef int StartMain(int (*)(int, char**, char**), int, char**, void (*)(void), void (*)(void), void (*)(void), void*);
int __libc_start_main(int (*main)(int, char**, char**), int argc, char** argv, void (*init)(void), void (*fini)(void),
                      void (*rtld_fini)(void), void* stack_end);
int __libc_start_main(int (*main)(int, char**, char**), int argc, char** argv, void (*init)(void), void (*fini)(void),
                      void (*rtld_fini)(void), void* stack_end) {
  program_main = main;
  return ((StartMain*)real("__libc_start_main"))(serve, argc, argv, init, fini, rtld_fini, stack_end);
}
